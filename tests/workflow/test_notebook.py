"""The notebook and the README's lines of Python run as they stand."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "examples" / "soybean.ipynb"


def cells():
    found = json.loads(NOTEBOOK.read_text())["cells"]
    return ["".join(c["source"]) for c in found if c["cell_type"] == "code"]


def python_of_the_readme():
    (block,) = re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)
    return block


def test_the_cells_are_python_and_the_notebook_holds_no_output():
    for text in (*cells(), python_of_the_readme()):
        compile(text, "cell", "exec")
    assert '"outputs": []' in NOTEBOOK.read_text()


@pytest.mark.slow
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    folder = shutil.copytree(ROOT / "examples", tmp_path / "examples")  # a notebook begins in it
    command = [sys.executable, "-c", "\n".join(cells())]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results/soybean/screening/effects.csv").is_file()
