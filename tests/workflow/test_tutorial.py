"""The tutorial's commands run as they stand: a study of one's own from the measured tests to the
report, and a heap; and the notebook runs as it stands."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from facts import ROOT, tells
from started import python

BLOCK = re.compile(r"^```bash\n(.*?)^```", re.M | re.S)


@pytest.mark.long
@pytest.mark.slow
def test_the_tutorial_runs_from_top_to_bottom(tmp_path):
    blocks = BLOCK.findall((ROOT / "docs" / "tutorial.md").read_text())
    assert len(blocks) > 5
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    shown = []
    for block in blocks:
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block],
            cwd=tmp_path, env=os.environ | {"PATH": path, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{block}\n{done.stdout}\n{done.stderr}"
        shown.append(done.stdout + done.stderr)
    text = "\n".join(shown)
    assert tells(text, "option --measured 281", "3 to 89")
    assert tells(text, "beans", "runs done", "none failed")
    assert "angle_of_repose_deg" in text
    assert "particles.cuont" in text
    assert not (tmp_path / "wrong").exists()
    study = tmp_path / "results" / "beans"
    assert (study / "report.html").is_file()
    optimum = json.loads((study / "optimise" / "optimum.json").read_text())
    assert optimum["interval_95_others_held"]
    screening = json.loads((study / "screening" / "screening.json").read_text())
    assert len(screening["factors"]) == 5  # after the change


NOTEBOOK = ROOT / "examples" / "soybean.ipynb"


def cells():
    found = json.loads(NOTEBOOK.read_text())["cells"]
    return ["".join(c["source"]) for c in found if c["cell_type"] == "code"]


@pytest.mark.slow
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    folder = shutil.copytree(ROOT / "examples", tmp_path / "examples")  # a notebook begins in it
    python(folder, "-c", "\n".join(cells()))
    assert (tmp_path / "results/soybean/screening/effects.csv").is_file()
