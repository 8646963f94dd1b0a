"""Designs have the properties that their names promise, and wrong tables are refused where they are
wrong."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.errors import CalibrationError
from calibration.statistics.design import box_behnken, path_from_effects, steepest_path
from calibration.statistics.screening_design import plackett_burman, read_two_level
from calibration.statistics.surface import model_matrix, quadratic_terms
from calibration.study.factors import Factor, read_factors
from facts import refused

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "data" / "paper"


def factors(k):
    return [Factor(chr(65 + i), f"f{i}", f"k{i}", 10.0 * i, 10.0 * i + 4.0) for i in range(k)]


def coded(table, k):
    return table[[f.code for f in factors(k)]].to_numpy()


@pytest.mark.parametrize(
    ("k", "runs"),
    [(4, 12), (7, 12), (8, 12), (11, 12), (12, 16), (15, 16), (16, 20), (20, 24), (23, 24)],
)
def test_screening_takes_the_smallest_design_of_twelve_or_more(k, runs):
    assert len(plackett_burman(factors(k))) == runs


def test_more_runs_can_be_asked_for():
    x = coded(plackett_burman(factors(7), runs=20), 7)
    assert np.array_equal(x.T @ x, 20 * np.eye(7))
    for runs in (8 - 4, 10, 28):
        with refused(CalibrationError, f"{runs} runs", "7 factors"):
            plackett_burman(factors(7), runs=runs)


def test_natural_levels_stand_beside_coded_ones():
    table = plackett_burman(factors(4), replicates=3)
    assert list(table["run"]) == list(range(1, 37))
    assert list(table["replicate"].unique()) == [1, 2, 3]
    for f in factors(4):
        assert table[f.name].to_numpy() == pytest.approx(f.centre + 2.0 * table[f.code].to_numpy())
        assert f.coded(table[f.name]).to_numpy() == pytest.approx(table[f.code].to_numpy())


def test_shipped_factors_are_table_5():
    printed = pd.read_csv(PAPER / "table05_contact_parameter_ranges.csv", comment="#")
    factors = read_factors(ROOT / "config" / "factors.tsv")
    found = [(f.code, f.name, f.low, f.high) for f in factors]
    assert found == [tuple(row) for row in printed.itertuples(index=False)]


def test_the_papers_design_is_read_with_its_natural_levels():
    table_5 = read_factors(ROOT / "config" / "factors.tsv")
    table = read_two_level(PAPER / "table06_plackett_burman.csv", table_5)
    printed = pd.read_csv(PAPER / "table06_plackett_burman.csv", comment="#")
    assert (
        table[list("ABCDEFG")].to_numpy().tolist() == printed[list("ABCDEFG")].to_numpy().tolist()
    )
    assert table.loc[0, "salt_salt_restitution"] == 0.75
    assert table.loc[0, "salt_salt_rolling_friction"] == 0.05


@pytest.mark.parametrize("k", range(3, 8))
def test_a_box_behnken_design_estimates_the_quadratic_model(k):
    table = box_behnken(factors(k), centre_runs=5)
    x = coded(table, k)
    terms = quadratic_terms([f.code for f in factors(k)])
    matrix = model_matrix(x, [f.code for f in factors(k)], terms)
    assert np.linalg.matrix_rank(matrix) == len(terms)
    # main effects and interactions are orthogonal to each other and to all the rest
    gram = matrix.T @ matrix
    crossed = [i for i, t in enumerate(terms) if len(set(t)) == len(t) > 0]
    off = gram[crossed] - np.diag(np.diag(gram))[crossed]
    assert not off.any()
    # never a corner, and every factor equally often at either level
    assert np.abs(x).sum(axis=1).max() < k
    assert len(set((x == 1).sum(axis=0)) | set((x == -1).sum(axis=0))) == 1
    assert (np.abs(x).sum(axis=1) == 0).sum() == 5


def test_the_papers_second_design_is_a_box_behnken_design():
    printed = pd.read_csv(PAPER / "table11_box_behnken.csv", comment="#")[
        ["X", "Y", "Z"]
    ].to_numpy()
    ours = coded(box_behnken(factors(3), centre_runs=5), 3)
    assert sorted(map(tuple, printed)) == sorted(map(tuple, ours))


def test_table_10_from_its_start_and_steps():
    path = pd.read_csv(PAPER / "table10_steepest_ascent.csv", comment="#")
    table_5 = {f.code: f for f in read_factors(ROOT / "config" / "factors.tsv")}
    chosen = [table_5[c] for c in "GEC"]
    start = dict(zip((f.name for f in chosen), (0.11, 0.75, 0.26), strict=True))
    step = dict(zip((f.name for f in chosen), (0.06, -0.15, 0.06), strict=True))
    table = steepest_path(chosen, start, step, 5)
    for f, column in zip(chosen, "XYZ", strict=True):
        assert table[f.name].to_numpy() == pytest.approx(path[column].to_numpy())
    with refused(CalibrationError, "6", "salt_salt_rolling_friction"):
        steepest_path(chosen, start, step, 6)


def test_the_path_of_the_effects_is_the_gradient_in_coded_levels():
    chosen = factors(3)
    effects = {"A": 4.0, "B": -2.0, "C": 1.0}
    start, step = path_from_effects(chosen, effects, 5)
    table = steepest_path(chosen, start, step, 5)
    x = coded(table, 3)
    assert np.diff(x, axis=0) == pytest.approx(np.tile([0.5, -0.25, 0.125], (4, 1)))
    assert x.mean(axis=0) == pytest.approx(np.zeros(3))
    assert np.abs(x).max() == 1.0
    # no direction of the same length climbs a plane with these effects faster
    slope = np.array([2.0, -1.0, 0.5])
    way = x[-1] - x[0]
    assert slope @ way == pytest.approx(np.linalg.norm(slope) * np.linalg.norm(way))
