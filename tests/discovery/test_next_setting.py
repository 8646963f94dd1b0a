"""What is not told apart asks for a setting that does."""

import pytest

from calibration.intake.measurements import Measurement
from diagnosis.laws.readings import readings_of
from diagnosis.next_measurement import propose_setting
from diagnosis.table_model.selection import blocks_of

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
    [bare] = blocks_of([readings_of(measured, "drop")], None).values()
    return bare.holding(LAW)


def test_a_law_and_an_error_of_each_level_ask_for_a_level_that_is_new(block):
    found = propose_setting(block, LAW, ["drop:levels of drop_height_mm"])
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
    found = propose_setting(block, LAW, ["drop:restitution(speed, size)"])
    laws = ("restitution of speed", "restitution of speed and size")
    assert set(found["predictions"]) == set(laws)
    assert found["information_bits"] > 0.1
