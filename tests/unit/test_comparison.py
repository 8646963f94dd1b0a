"""The comparison of ways to calibrate: same studies for all, right intervals, what was found."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.ways.__main__ import summary, trials
from benchmarks.ways.truths import INSIDE, SEED_SD, STEP, TRUTHS, Bench, packed
from benchmarks.ways.ways import CUBE, CUT, GRID, WAYS, _implausible, answer
from calibration.inference.gaussian_process import GaussianProcess
from paper.release.values import enough


@pytest.mark.parametrize("name", TRUTHS)
def test_a_study_is_the_same_for_every_way_and_its_target_can_be_met(name):
    one, two = (Bench.drawn(TRUTHS[name], 5) for _ in range(2))
    assert np.array_equal(one.truth, two.truth)
    assert one.measured == two.measured
    assert np.abs(one.truth).max() <= INSIDE
    assert one.missed(one.truth) == 0.0
    single = one.run(np.zeros((4000, 3)))
    share = packed(np.zeros(3))[0] if name == "two kinds" else 0.0
    assert single.mean() == pytest.approx(TRUTHS[name](np.zeros(3))[0], abs=0.1)
    sd = np.sqrt(SEED_SD**2 + STEP**2 * share * (1 - share))
    assert single.std() == pytest.approx(sd, rel=0.05)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    found = TRUTHS[name](corners)
    assert found.min() < one.measured < found.max()


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_each_way_comes_near_with_many_runs(way):
    """Single studies miss by the measurement's own error, 0.16 degrees, and by the fit's."""
    bench = Bench.drawn(TRUTHS["nearly plane"], 11)
    point, low, high = answer(way, bench, 47)
    assert np.abs(point).max() <= 1.0
    assert abs(bench.missed(point)) < 1.2
    if low is not None:
        assert (low <= high).all()
        assert low.min() >= GRID[0]
        assert high.max() <= GRID[-1]


def test_the_page_says_what_the_trials_hold(monkeypatch):
    monkeypatch.setattr("benchmarks.ways.__main__.RUNS", (22,))
    one = dict(list(TRUTHS.items())[:1])  # a release asks all of them
    monkeypatch.setattr("benchmarks.ways.__main__.TRUTHS", one)
    table = trials(1)
    assert len(table) == len(WAYS)
    made_up = pd.DataFrame(
        {"way": ["paper's chain"] * 4 + ["Gaussian-process optimiser"] * 4,
         "runs": [22, 22, 92, 92] * 2,
         "miss": [0.3, -0.5, 0.1, -0.1, 1.0, 1.0, 0.6, np.nan],
         "held": [3, 0, 3, 3] + [np.nan] * 4, "width_of_the_strongest": [0.2] * 4 + [np.nan] * 4}
    )  # fmt: skip
    found = summary(made_up)
    first = found.iloc[0]
    assert first["rmse"] == pytest.approx(np.sqrt((0.09 + 0.25) / 2))
    assert first["coverage"] == pytest.approx(50.0)
    assert found["errors"].tolist() == [0, 0, 0, 1]
    assert enough(found) == [(92, ["paper's chain"]), (None, ["Gaussian-process optimiser"])]


@pytest.mark.slow
def test_history_matching_rules_out_what_misses_and_keeps_what_meets():
    """On a plane without scatter what is left is a slab about the plane of the measured value."""
    bench = Bench.drawn(TRUTHS["nearly plane"], 3)
    x, y = WAYS["history matching"][0](bench, 47)
    left = CUBE[_implausible(GaussianProcess().fit(0.5 + 0.5 * x, y), bench) <= CUT]
    apart = np.abs(TRUTHS["nearly plane"](left) - bench.measured)
    assert 0 < len(left) < 0.8 * len(CUBE)
    assert apart.max() < 2.5  # of a range of eleven degrees
    _, low, high = answer("history matching", bench, 47)
    assert (low <= bench.truth).all()
    assert (bench.truth <= high).all()
