"""Draws the rules of a study as the workflow has them: docs/img/rulegraph.svg.

python docs/rulegraph.py (graphviz' `dot` draws it)
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs/img/rulegraph.svg"
READ = ("Snakefile", "workflow", "config", "profiles", "src", "data")
"""What the workflow reads of the project."""


def rulegraph():
    """The graph of the rules that make the salt's study from nothing, in the language of dot.

    Raises subprocess.CalledProcessError with snakemake's exit status.
    """
    with TemporaryDirectory() as folder:
        for name in READ:
            Path(folder, name).symlink_to(ROOT / name)
        command = [sys.executable, "-m", "snakemake", "--rulegraph", "--", "all"]
        done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout[done.stdout.index("digraph") :]


if __name__ == "__main__":
    drawn = subprocess.run(
        ["dot", "-Tsvg"], input=rulegraph(), check=True, capture_output=True, text=True
    )
    PICTURE.write_text(drawn.stdout)
