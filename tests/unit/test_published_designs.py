"""Published analyses of designed experiments, to the digits that are printed."""

import numpy as np
import pandas as pd
import pytest

from calibration.factors import Factor
from calibration.statistics.screening import screen
from calibration.statistics.surface import fit_surface, quadratic_terms
from calibration.statistics.two_level import foldover, fractional_factorial


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


def test_the_foldover_of_the_eye_focus_time():
    """Montgomery, Design and Analysis of Experiments, 8th edition, example 8.7: the 2^(7-4) design
    of resolution III with D = AB, E = AC, F = BC, G = ABC, its foldover, and the effects of each
    half and of both."""
    factors = [Factor(c, f"f{c}", f"k{c}", 0.0, 1.0) for c in "ABCDEFG"]
    three = pd.DataFrame(
        fractional_factorial(["a", "b", "c", "ab", "ac", "bc", "abc"]), columns=list("ABCDEFG")
    )
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
