"""Sobol indices agree with a closed form, and with SALib's of the same points."""

import numpy as np
import pytest
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from calibration.errors import CalibrationError
from calibration.sobol import SAMPLES, sobol_indices


def test_sobols_g_function():
    """First-order and total indices in closed form: V_i = 1 / (3 (1 + a_i)^2), V = prod (1 + V_i) -
    1 (Saltelli and Sobol 1995, Reliability Engineering and System Safety 50:225)."""
    a = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])
    part = 1.0 / (3.0 * (1.0 + a) ** 2)
    whole = np.prod(1.0 + part) - 1.0
    total = part * np.prod(1.0 + part) / (1.0 + part) / whole

    def g(u):
        return np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1)

    found = sobol_indices(g, list("ABCDEFGH"))
    for k, row in enumerate(found.values()):
        assert row["first"] == pytest.approx(part[k] / whole, abs=0.02)
        assert row["total"] == pytest.approx(total[k], abs=0.02)
    with pytest.raises(CalibrationError, match="constant"):
        sobol_indices(lambda u: np.ones(len(u)), ["A", "B"])


def test_the_indices_are_those_of_salib():
    def response(u):
        return u[:, 0] + 2.0 * u[:, 1] * u[:, 2] + np.sin(3.0 * u[:, 2])

    names = list("ABC")
    problem = {"num_vars": 3, "names": names, "bounds": [[0.0, 1.0]] * 3}
    u = sampling.sample(problem, SAMPLES, calc_second_order=False, seed=7)
    theirs = analysis.analyze(problem, response(u), calc_second_order=False, seed=7)
    ours = sobol_indices(response, names, seed=7)
    for word, key in {"first": "S1", "first_half": "S1_conf", "total": "ST"}.items():
        assert [row[word] for row in ours.values()] == pytest.approx(theirs[key], abs=1e-12)
    halves = [row["total_half"] for row in ours.values()]
    assert halves == pytest.approx(theirs["ST_conf"], abs=1e-12)
