"""Forms that the data do not tell apart ask for a setting that does."""

import numpy as np
import pytest

from calibration.intake.measurements import Measurement
from diagnosis.laws.choose import trial
from diagnosis.laws.next_setting import propose
from diagnosis.laws.readings import readings_of, with_setting

HEIGHTS, SIZES = (50.0, 75.0, 110.0, 165.0, 250.0), (1.5, 2.0, 3.0)
POWER = -0.15


def rebound(height, size):
    """Its value where the restitution is 0.7 (v / 1.4 m/s)^POWER, noise-free, known to 1 %."""
    value = height * 0.7**2 * (height / 100.0) ** POWER
    levers = {"drop_height_mm": height, "particle_diameter_mm": size}
    return Measurement("drop", value, 0.0224 * value, 5, levers)


@pytest.fixture(scope="module")
def tried():
    measured = [rebound(h, d) for h in HEIGHTS for d in SIZES]
    return trial(readings_of(measured, "drop"), replicates=0)


def test_a_power_and_a_loss_ask_for_a_height_beyond_the_plan(tried):
    law = tried.laws["drop:restitution(speed)"]
    found = propose(tried, law, ["power", "fixed loss of energy"], [])
    height = found["levers"]["drop_height_mm"]
    assert height in (25.0, 500.0)
    power, loss = (found["predictions"][n] for n in ("power", "fixed loss of energy"))
    # what made the data expects what would be read there
    assert power["value"] == pytest.approx(rebound(height, 2.0).value, rel=0.01)
    assert abs(power["value"] - loss["value"]) > 3.0 * max(power["sd"], loss["sd"])
    assert 0.5 < found["information_bits"] <= 1.0


def test_laws_of_other_states_ask_for_what_parts_their_levers(tried):
    law = tried.laws["drop:restitution(speed)"]
    found = propose(tried, law, ["power"], ["drop:restitution(speed, size)"])
    assert set(found["predictions"]) == {"restitution of speed", "restitution of speed and size"}
    assert found["information_bits"] > 0.1


def test_a_single_contender_asks_for_nothing(tried):
    law = tried.laws["drop:restitution(speed)"]
    assert propose(tried, law, ["power"], []) is None


def test_a_setting_that_weighs_nothing_leaves_the_fit(tried):
    wider = with_setting(tried.readings, {"drop_height_mm": 500.0, "particle_diameter_mm": 2.0})
    assert len(wider.log) == len(tried.readings.log) + 1
    assert wider.error[-1] > 20.0 * np.median(wider.error)
    assert wider.levers["drop_height_mm"][-1] == 500.0
