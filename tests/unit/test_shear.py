"""Yield loci and the friction for a measured slope, from shear stresses made by a known law."""

import numpy as np
import pytest

from calibration.shear import SlopeCurve, yield_locus

FRICTION, NORMAL = np.meshgrid([0.2, 0.4, 0.6, 0.85], np.repeat([0.5, 1.0, 2.0], 3))
FRICTION, NORMAL = FRICTION.ravel(), NORMAL.ravel()


def bulk_slope(mu):
    return 0.4 + 0.9 * mu - 0.5 * mu**2


def stress(noise):
    scatter = np.random.default_rng(4).normal(0.0, noise, len(NORMAL))
    return NORMAL * (bulk_slope(FRICTION) + scatter) + 0.08


def test_an_exact_law_gives_its_own_slopes_and_inverse():
    curve = SlopeCurve.fit(FRICTION, NORMAL, stress(0.0))
    assert curve.at(0.5)[0] == pytest.approx(bulk_slope(0.5))
    friction, interval = curve.inverse(bulk_slope(0.55))
    assert friction == pytest.approx(0.55, abs=1e-4)
    assert interval is None or interval[0] == pytest.approx(0.55, abs=2e-3)


def test_the_interval_of_the_inverse_covers_the_truth_and_widens_with_the_scatter():
    widths = []
    for noise in (0.02, 0.06):
        _, (low, high) = SlopeCurve.fit(FRICTION, NORMAL, stress(noise)).inverse(bulk_slope(0.5))
        assert low < 0.5 < high
        widths.append(high - low)
    assert widths[1] > widths[0]


def test_a_slope_out_of_reach_has_no_inverse():
    curve = SlopeCurve.fit(FRICTION, NORMAL, stress(0.02))
    assert curve.inverse(1.5) == (None, None)


def test_yield_locus_of_a_line_with_apparent_cohesion():
    locus = yield_locus([0.5, 1.0, 2.0, 4.0], [0.50, 0.93, 1.77, 3.46])
    assert locus["slope"] == pytest.approx(0.845, abs=0.005)
    assert locus["slope_interval"][0] < locus["slope"] < locus["slope_interval"][1]
    assert locus["intercept_kPa"] == pytest.approx(0.08, abs=0.01)
