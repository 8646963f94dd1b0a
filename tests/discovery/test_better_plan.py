"""A better plan has as many settings, and shows weaker laws."""

import numpy as np
import pytest

from calibration.intake.measurements import Measurement
from diagnosis.better_plan import exchange, plans


def test_the_exchange_finds_the_known_optimum():
    """Of a parabola: as many settings at both ends and in the middle (Kiefer 1959)."""

    def informed(settings):
        x = np.array(settings)[:, 0]
        terms = np.stack([np.ones_like(x), x, x**2], 1)
        return np.linalg.slogdet(terms.T @ terms + 1e-9 * np.eye(3))[1]

    levels = [(float(x),) for x in np.linspace(-1.0, 1.0, 9)]
    found = exchange([(0.1 * k,) for k in range(6)], levels, informed)
    assert sorted(x for (x,) in found) == [-1.0, -1.0, 0.0, 0.0, 1.0, 1.0]


def crowded():
    """Nine drops, seven of them from nearly the same height."""
    heights = (60.0, 110.0, 115.0, 120.0, 120.0, 125.0, 130.0, 135.0, 240.0)
    return [
        Measurement("drop", 0.49 * h, 0.01 * h, 5, {"drop_height_mm": h, "particle_diameter_mm": d})
        for h, d in zip(heights, (2.0, 2.0, 1.8, 2.2, 2.0, 2.0, 1.8, 2.2, 2.0), strict=True)
    ]


@pytest.mark.parametrize("which", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_plan_costs_the_same_and_stays_in_its_ranges(which):
    plan, found = crowded(), plans(crowded())[which]
    assert len(found) == len(plan)
    for name in ("drop_height_mm", "particle_diameter_mm"):
        old, new = ([m.levers[name] for m in p] for p in (plan, found))
        assert min(old) <= min(new) <= max(new) <= max(old)
    assert {m.n for m in found} == {5}
    # a constant coefficient: the values that the plan guesses
    assert [m.value / m.levers["drop_height_mm"] for m in found] == pytest.approx([0.49] * 9)
