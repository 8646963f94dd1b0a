"""The notebook runs as it stands."""

import json
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


@pytest.mark.slow
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    folder = shutil.copytree(ROOT / "examples", tmp_path / "examples")  # a notebook begins in it
    command = [sys.executable, "-c", "\n".join(cells())]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results/soybean/screening/effects.csv").is_file()
