"""A sample made of two draws: found by what its runs were computed with, told and tested."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf

from calibration.interface.cli import main
from calibration.runs.all_runs import difference, mixtures
from calibration.runs.plans import run_id
from calibration.study.stage import load_stages
from calibration.telling.report.build import runs_section
from dem import results
from dem.io.files import write_json
from dem.results import write_result
from dem.spec import parse_spec
from facts import holds

SOFTWARE = {"numba": "0.62.0", "llvmlite": "0.45", "numpy": "2.1.0", "python": "3.11.7"}


def sample(seed, shift=0.0, points=6, each=4, scatter=1.0):
    """Values at points whose means differ, half of them of a second draw that is `shift` lower."""
    rng = np.random.default_rng(seed)
    at = np.repeat(np.arange(points), each)
    second = rng.permutation(np.arange(len(at)) % 2 == 1)
    values = 10.0 * at - shift * second + scatter * rng.normal(size=len(at))
    return values, second, at.tolist()


@pytest.mark.parametrize("seed", range(5))
def test_the_difference_is_that_of_least_squares_with_a_mean_for_each_point(seed):
    values, second, at = sample(seed, shift=0.7)
    table = pd.DataFrame({"y": values, "d": second.astype(float), "p": at})
    fit = smf.ols("y ~ d + C(p)", table).fit()
    low, high = -fit.conf_int().loc["d"].to_numpy()[::-1]
    expected = (-fit.params["d"], low, high, fit.pvalues["d"])
    assert difference(values, second, at) == pytest.approx(expected, rel=1e-9)


def test_without_a_point_of_both_nothing_is_said_of_a_difference():
    assert difference(np.arange(4.0), np.array([0, 0, 1, 1], bool), [1, 1, 2, 2]) is None
    assert difference(np.array([1.0, 2.0]), np.array([0, 1], bool), [1, 1]) is None
    assert difference(np.full(4, np.nan), np.array([0, 1, 0, 1], bool), [1] * 4) is None


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A screening of two points, each with two runs of one numba and two of another whose metric is
    3 mm higher."""
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
            value = height + 0.01 * seed + 3.0 * (seed >= 2)
            write_result(
                folder, parse_spec(spec), {"rebound_height_mm": value}, {"wall_time_s": 1.0}
            )
            specs[folder.name] = spec
    write_json(Path("results/drops/screening/plan.json"), specs)
    return Path("results/drops")


def test_runs_of_two_versions_are_a_mixture(study):
    [mixture] = mixtures(study)
    assert mixture.stage == "screening"
    assert mixture.draws == {("0.62.0", "2.1.0", "znver3"): 4, ("0.63.1", "2.1.0", "znver3"): 4}
    assert mixture.difference.metric == "rebound_height_mm"
    assert mixture.difference.value == pytest.approx(-3.02)
    assert mixture.difference.p < 1e-3
    for words in ("numba 0.62.0", "numba 0.63.1", "znver3", "they differ"):
        assert holds(str(mixture), words)


def test_runs_of_one_version_are_none(study, monkeypatch):
    for path in Path("results/runs").glob("*/result.json"):
        if "0.63.1" in path.read_text():
            path.unlink()
    assert mixtures(study) == []


def test_verify_and_report_tell_of_it(study, capsys):
    main(["verify"])
    assert holds(capsys.readouterr().out, "numba 0.63.1")
    names = [p.parent.name for p in sorted(Path("results/runs").glob("*/result.json"))]
    pd.DataFrame({"run_id": names}).to_csv(study / "screening" / "design.csv", index=False)
    section = runs_section(study, load_stages())
    assert any(holds(text, "numba 0.63.1") for text in section["texts"])
