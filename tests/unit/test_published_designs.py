"""Published analyses of designed experiments, to the digits that are printed.

Data and printed results were compared with their sources when they were entered, not typed from
memory: R's package rsm 2.10.6 (datasets, the example of `rsm`, and the outputs in its vignette
article-JSS) for ChemReact and RRex; worked notes on Montgomery's chapter 8 that print both
fractions and all effects of examples 8.7 and 8.8, and three independent transcriptions of the first
fraction's data.
"""

import numpy as np
import pandas as pd
import pyDOE3
import pytest

from calibration.statistics.screening import screen
from calibration.statistics.screening_design import foldover, plackett_burman
from calibration.statistics.surface import fit_surface, quadratic_terms
from calibration.study.factors import Factor


def test_the_central_composite_design_of_the_chemical_reaction():
    """ChemReact: Myers, Montgomery and Anderson-Cook (2009), Response Surface Methodology, 3rd
    edition, table 7.6, as fitted in two blocks by R's rsm (Lenth 2009, Journal of Statistical
    Software 32(7), section 3.2)."""
    points = [(-1, -1), (-1, 1), (1, -1), (1, 1), *[(0, 0)] * 3]
    star = [*[(0, 0)] * 3, (1.414, 0), (-1.414, 0), (0, 1.414), (0, -1.414)]
    design = pd.DataFrame(points + star, columns=["A", "B"], dtype=float)
    design["Z"] = np.repeat([0.0, 1.0], 7)
    y = [80.5, 81.5, 82.0, 83.5, 83.9, 84.3, 84.0, 79.7, 79.8, 79.5, 78.4, 75.6, 78.5, 77.0]
    surface = fit_surface(design, ["A", "B", "Z"], y, [*quadratic_terms(["A", "B"]), ("Z",)])
    found = surface.coefficients.set_index("term")["estimate"]
    printed = {"Intercept": 84.09543, "Z": -4.45753, "A": 0.93254, "B": 0.57771, "AB": 0.12500}
    printed |= {"A²": -1.30856, "B²": -0.93344}
    assert found[list(printed)].to_dict() == pytest.approx(printed, abs=6e-6)
    # the stationary point in the two factors, and the eigenvalues
    linear = found[["A", "B"]].to_numpy()
    half = 0.5 * found["AB"]
    quadratic = np.array([[found["A²"], half], [half, found["B²"]]])
    assert np.linalg.solve(-2 * quadratic, linear) == pytest.approx(
        [0.3722954, 0.3343802], abs=6e-6
    )
    assert np.linalg.eigvalsh(quadratic) == pytest.approx([-1.3186949, -0.9233027], abs=6e-6)
    # the standard errors; the first is that of the intercept, at the centre of the first block
    error = [0.079631, 0.087226, 0.057699, 0.081592, 0.060064]
    se = surface.coefficients.set_index("term")["se"]
    assert se[["Intercept", "Z", "A", "AB", "A²"]].to_numpy() == pytest.approx(error, abs=6e-7)


def plackett_and_burman():
    """The twelve runs as Plackett and Burman (1946, Biometrika 33:305) generate them: a row, turned
    ten times, and a row of low levels."""
    row = np.array([1, 1, -1, 1, 1, 1, -1, -1, -1, 1, -1])
    return np.vstack([*[np.roll(row, k) for k in range(11)], -np.ones(11)])


def test_the_twelve_runs_are_those_that_manuals_print():
    """Eleven turns of one row and a row of high levels, as Altair's HyperStudy manual prints them
    (Plackett Burman, 2021) and, by memory alone, NIST's handbook 5.3.3.5."""
    factors = [Factor(chr(65 + k), f"f{k}", f"k{k}", 0.0, 1.0) for k in range(11)]
    ours = plackett_burman(factors)[[f.code for f in factors]].to_numpy()
    row = np.array([-1, 1, -1, 1, 1, 1, -1, -1, -1, 1, -1])
    printed = np.vstack([np.ones(11), *[np.roll(row, k) for k in range(11)]])
    assert {tuple(row) for row in ours} == {tuple(row) for row in printed}


def test_the_effects_of_a_printed_plackett_burman_experiment():
    """Montgomery, Design and Analysis of Experiments, example 8.8: eleven factors in twelve runs of
    a made-up process. For C the book prints 12.667 as effect, but 6.833 as coefficient and 560.333
    as sum of squares, which 13.667 gives."""
    codes = list("ABCDEFGHJKL")
    table = pd.DataFrame(plackett_and_burman(), columns=codes)
    y = np.array([231, 207, 230, 217, 175, 176, 183, 185, 181, 220, 229, 168.0])
    printed = [12.667, 13.333, 13.667, 34.0, 13.667, 1.0, -2.333, 3.0, -12.667, -11.667, -0.333]
    found = screen(table, codes, y).table.set_index("code")["effect"]
    assert found[codes].to_numpy() == pytest.approx(printed, abs=6e-4)
    assert 12 * (found["C"] / 2) ** 2 == pytest.approx(560.333, abs=6e-4)


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
