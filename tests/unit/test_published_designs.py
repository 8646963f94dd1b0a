"""Published analyses of designed experiments, to the digits that are printed.

Data and printed results were compared with their sources when they were entered, not typed from
memory: R's package rsm 2.10.6 (the example of `rsm`) for RRex; worked notes on Montgomery's chapter
8 that print both fractions and all effects of example 8.7, and three independent transcriptions of
the first fraction's data.
"""

import numpy as np
import pandas as pd
import pyDOE3
import pytest

from calibration.statistics.screening import screen
from calibration.statistics.screening_design import foldover, plackett_burman
from calibration.statistics.surface import fit_surface
from calibration.study.factors import Factor


def test_the_twelve_runs_are_those_that_manuals_print():
    """Eleven turns of one row and a row of high levels, as Altair's HyperStudy manual prints them
    (Plackett Burman, 2021) and, by memory alone, NIST's handbook 5.3.3.5."""
    factors = [Factor(chr(65 + k), f"f{k}", f"k{k}", 0.0, 1.0) for k in range(11)]
    ours = plackett_burman(factors)[[f.code for f in factors]].to_numpy()
    row = np.array([-1, 1, -1, 1, 1, 1, -1, -1, -1, 1, -1])
    printed = np.vstack([np.ones(11), *[np.roll(row, k) for k in range(11)]])
    assert {tuple(row) for row in ours} == {tuple(row) for row in printed}


def test_the_foldover_of_the_eye_focus_time():
    """Montgomery, Design and Analysis of Experiments, 8th edition, example 8.7: the 2^(7-4) design
    of resolution III with D = AB, E = AC, F = BC, G = ABC, its foldover, and the effects of each
    half and of both."""
    factors = [Factor(c, f"f{c}", f"k{c}", 0.0, 1.0) for c in "ABCDEFG"]
    runs = pyDOE3.fracfact("a b c ab ac bc abc")
    runs = runs[np.lexsort(runs[:, :3].T)]  # as they are printed: the first factor changes first
    three = pd.DataFrame(runs, columns=list("ABCDEFG"))
    first = [85.5, 75.1, 93.2, 145.4, 83.7, 77.6, 95.0, 141.8]
    second = [91.3, 136.7, 82.4, 73.4, 94.1, 143.8, 87.3, 71.9]
    both = foldover(three, factors)
    printed = {
        1: [20.63, 38.38, -0.28, 28.88, -0.28, -0.63, -2.43],
        2: [-17.68, 37.73, -3.33, 29.88, 0.53, 1.63, 2.68],
        0: [1.48, 38.05, -1.80, 29.38, 0.13, 0.50, 0.13],
    }
    assert list(both["run"]) == list(range(1, 17))
    assert both["fA"].to_numpy() == pytest.approx(0.5 + 0.5 * both["A"].to_numpy())
    both["y"] = first + second
    for fold, effects in printed.items():
        here = both[both["fold"] == fold] if fold else both
        found = screen(here, list("ABCDEFG"), here["y"]).table["effect"]
        assert found.to_numpy() == pytest.approx(effects, abs=0.0051)


def test_a_rising_ridge_is_told():
    """Myers, Montgomery and Anderson-Cook, table 6.2 (the example `RRex` of R's rsm), a rising
    ridge: without the flat axis the stationary point lies inside the experiment, with it twice as
    far out as any run."""
    points = [(-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1), *[(0, 0)] * 3]
    design = pd.DataFrame(points, columns=["A", "B"], dtype=float)
    y = [52.3, 5.3, 46.7, 44.2, 58.5, 33.5, 32.8, 49.2, 49.3, 50.2, 51.6]
    surface = fit_surface(design, ["A", "B"], y)
    found = surface.canonical()
    assert found["kind"] == "ridge"
    assert np.abs(found["point"]).max() < 1.0
    linear, quadratic = surface.coefficients["estimate"].to_numpy()[[1, 2]], found["axes"]
    full = quadratic @ (-0.5 * (quadratic.T @ linear) / found["eigenvalues"])
    assert np.linalg.norm(full) > 2.0 * np.sqrt(2.0)
