"""Verdicts of the scaling study follow from its numbers: planted answers give the matching
verdicts."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

from calibration.stages.scaling import (
    CHANGED,
    FAILS,
    HOLDS,
    UNDECIDED,
    exponent_statements,
    log_slope,
    response_statements,
    response_table,
    scaling_figure,
)
from calibration.statistics.numbers import fixed
from facts import tells

MARGINS = {"heap": 2.0, "drop": 0.02}
RIGHT = {"damping_coefficient": 2}


def heaps(shift, sd=0.5, n=8):
    """Angles at scales 1, 2 and 4 that fall by `shift` degrees a doubling."""
    rng = np.random.default_rng(2)
    rows = [(h, 45.0 - shift * np.log2(h) + sd * rng.normal()) for h in (1, 2, 4) for _ in range(n)]
    table = pd.DataFrame(rows, columns=["scale", "response"])
    return table.assign(experiment="heap", rule="paper", cohesive=True, left_in_funnel=0.0)


@pytest.mark.parametrize(
    ("shift", "sd", "verdict"), [(0.0, 0.5, HOLDS), (3.0, 0.5, FAILS), (0.0, 8.0, UNDECIDED)]
)
def test_a_planted_change_of_the_angle_is_found(shift, sd, verdict):
    runs = heaps(shift, sd)
    (statement,) = response_statements(runs, MARGINS)
    assert statement.verdict == verdict
    assert statement.low <= statement.found <= statement.high
    assert fixed(statement.found, 1, "+") in statement.sentence


def test_the_table_has_means_and_differences_from_the_first_scale():
    runs = heaps(3.0)
    table = response_table(runs, runs["response"], MARGINS)
    assert table["mean"].tolist() == pytest.approx([45.0, 42.0, 39.0], abs=0.6)
    assert table["difference"].tolist()[1:] == pytest.approx([-3.0, -6.0], abs=0.8)
    assert set(table["change"].iloc[1:]) == {CHANGED}


@pytest.mark.parametrize("scales", [(1,), (2,), (2, 4), (1, 2, 4)])
def test_an_end_at_which_every_heap_clogs_leaves_it_undecided(scales):
    runs = heaps(3.0)
    runs["response"] = runs["response"].mask(runs["scale"].isin(scales))
    (statement,) = response_statements(runs, MARGINS)
    ends = {1, 4} & set(scales)
    assert (statement.found is None) == bool(ends)
    assert statement.verdict == (UNDECIDED if ends else FAILS)
    assert tells(statement.sentence, f"{8 * len(scales)} of 24", "no value")
    table = response_table(runs, runs["response"], MARGINS)
    assert table["mean"].isna().tolist() == [h in scales for h in (1, 2, 4)]
    assert table["change"].iloc[-1] == (UNDECIDED if ends else CHANGED)
    plt.close(scaling_figure(table.assign(experiment="heap")))


def test_exponents_decide_the_statements():
    for stiffness, verdict in ((1, FAILS), (2, HOLDS)):
        verdicts = {s.id: s.verdict for s in exponent_statements(RIGHT | {"stiffness": stiffness})}
        assert verdicts == {"section122.stiffness": verdict, "section122.damping": HOLDS}


def test_log_slope_of_a_power_law():
    scale = np.array([1.0, 1.0, 2.0, 2.0, 4.0, 4.0])
    noise = np.array([1.01, 0.99, 1.0, 1.01, 0.99, 1.0])
    found, low, high = log_slope(scale, 3.0 * scale**0.5 * noise)
    assert low < 0.5 < high
    assert found == pytest.approx(0.5, abs=0.02)
