"""The analysis of the paper's own runs finds what the paper found; that it prints its tables is the
audit's (`test_audit.py`)."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.statistics.optimise import solve
from calibration.statistics.screening import screen, significant
from calibration.statistics.surface import fit_surface
from calibration.study.factors import Factor, read_factors

TABLES = Path(__file__).parents[2] / "data" / "paper"


def table(name):
    return pd.read_csv(TABLES / name, comment="#")


def test_the_screening_of_table_6_sends_on_what_the_paper_does():
    runs = table("table06_plackett_burman.csv")
    screening = screen(runs, list("ABCDEFG"), runs["angle_deg"])
    assert significant(screening, 0.05) == ["G", "E", "C"]
    assert screening.method == "residual"


def surface():
    runs = table("table11_box_behnken.csv").rename(columns={"X": "A", "Y": "B", "Z": "C"})
    return fit_surface(runs, list("ABC"), runs["angle_deg"])


def test_the_papers_optimum_lies_on_the_solution_set():
    coding = table("table11_coding.csv").set_index("factor")
    factors = [
        Factor(c, c, c, *coding.loc[x, ["low", "high"]]) for c, x in zip("ABC", "XYZ", strict=True)
    ]
    point = [f.coded(v) for f, v in zip(factors, (0.23, 0.544, 0.368), strict=True)]
    fit = surface()
    assert fit.predict([point])[0] == pytest.approx(45.27, abs=0.05)
    solution = solve(fit, 45.27)
    assert solution.attainable
    assert np.abs(fit.predict(solution.points) - 45.27).max() < 1e-4
    assert solution.predicted == pytest.approx(45.27, abs=1e-4)
    assert (solution.chosen**2).sum() <= (solution.points**2).sum(1).min() + 1e-9
    gap = np.linalg.norm(solution.points - point, axis=1).min()
    assert gap < 0.2


def test_shipped_factors_are_table_5():
    printed = table("table05_contact_parameter_ranges.csv")
    factors = read_factors(TABLES.parents[1] / "config" / "factors.tsv")
    assert [(f.code, f.name, f.low, f.high) for f in factors] == [
        tuple(row) for row in printed.itertuples(index=False)
    ]
