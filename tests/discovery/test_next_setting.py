"""What is not told apart asks for a setting that does."""

import numpy as np
import pytest

from calibration.intake.measurements import Measurement
from diagnosis.better_plan import exchange, plans
from diagnosis.laws.readings import readings_of
from diagnosis.table_model.next_setting import propose
from diagnosis.table_model.selection import blocks_of, with_terms

HEIGHTS, SIZES = (50.0, 75.0, 110.0, 165.0, 250.0), (1.5, 2.0, 3.0)
POWER = -0.15
LAW = "drop:restitution(speed)"


def rebound(height, size):
    """Its value where the restitution is 0.7 (v / 1.4 m/s)^POWER, noise-free, known to 1 %."""
    value = height * 0.7**2 * (height / 100.0) ** POWER
    levers = {"drop_height_mm": height, "particle_diameter_mm": size}
    return Measurement("drop", value, 0.0224 * value, 5, levers)


@pytest.fixture(scope="module")
def block():
    measured = [rebound(h, d) for h in HEIGHTS for d in SIZES]
    return with_terms(blocks_of([readings_of(measured, "drop")], None), "drop", [LAW])["drop"]


def test_a_law_and_an_error_of_each_level_ask_for_a_level_that_is_new(block):
    found = propose(block, LAW, ["drop:levels of drop_height_mm"])
    height = found["levers"]["drop_height_mm"]
    assert height not in HEIGHTS
    law = found["predictions"].pop("restitution of speed")
    [error] = found["predictions"].values()
    # what made the data expects what would be read there
    assert law["value"] == pytest.approx(rebound(height, 2.0).value, rel=0.01)
    assert error["sd"] > 3.0 * law["sd"]
    assert found["information_bits"] > 0.3
    assert "anew at 110 mm" in found["text"]
    assert "61.2 and 90.8 mm" in found["text"]


@pytest.mark.slow
def test_laws_of_other_states_ask_for_what_parts_their_levers(block):
    found = propose(block, LAW, ["drop:restitution(speed, size)"])
    laws = ("restitution of speed", "restitution of speed and size")
    assert set(found["predictions"]) == set(laws)
    assert found["information_bits"] > 0.1


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
