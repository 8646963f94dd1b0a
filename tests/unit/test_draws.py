"""A sample made of two draws: found by what its runs were computed with, and told."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.interface.cli import main
from calibration.runs.mixtures import finished, mixtures
from calibration.runs.plans import run_id
from calibration.study.stage import load_stages
from calibration.telling.report.build import runs_section
from dem import results
from dem.io.files import write_json
from dem.results import write_result
from dem.spec import parse_spec
from facts import holds

SOFTWARE = {"numba": "0.62.0", "llvmlite": "0.45", "numpy": "2.1.0", "python": "3.11.7"}


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A screening of two points, each with two runs of one numba and two of another."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(results, "cpu_target", lambda: "znver3")
    specs = {}
    for height in (5.0, 6.0):
        for seed in range(4):
            geometry = {"drop_height_mm": height, "drops": 1}
            spec = {"experiment": "drop", "seed": seed, "geometry": geometry}
            version = "0.62.0" if seed < 2 else "0.63.1"
            monkeypatch.setattr(results, "software", lambda v=version: SOFTWARE | {"numba": v})
            folder = Path("results/runs", run_id(spec))
            folder.mkdir(parents=True)
            np.savez(folder / "final.npz", position=np.zeros((1, 3)))
            metrics = {"rebound_height_mm": height}
            write_result(folder, parse_spec(spec), metrics, {"wall_time_s": 1.0})
            specs[folder.name] = spec
    write_json(Path("results/drops/screening/plan.json"), specs)
    return Path("results/drops")


def test_runs_of_two_versions_are_a_mixture(study):
    [said] = mixtures(finished(study))
    for words in ("screening", "4 runs", "numba 0.62.0", "numba 0.63.1", "znver3"):
        assert holds(said, words)


def test_runs_of_one_version_are_none(study, monkeypatch):
    for path in Path("results/runs").glob("*/result.json"):
        if "0.63.1" in path.read_text():
            path.unlink()
    assert mixtures(finished(study)) == []


def test_verify_and_report_tell_of_it(study, capsys):
    main(["verify"])
    assert holds(capsys.readouterr().out, "numba 0.63.1")
    names = [p.parent.name for p in sorted(Path("results/runs").glob("*/result.json"))]
    pd.DataFrame({"run_id": names}).to_csv(study / "screening" / "design.csv", index=False)
    section = runs_section(study, load_stages())
    assert any(holds(text, "numba 0.63.1") for text in section["texts"])
