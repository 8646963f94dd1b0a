"""Waves on real runs: a yielding contact hidden in drops of the engine."""

import pytest

from calibration.runs.simulated import simulate
from diagnosis import emulator_waves
from diagnosis.design import plan
from diagnosis.emulator import train
from diagnosis.model import Emulated

NAME = "plastic_restitution"


def error_of(found):
    return next(r["error"] for r in found if r["mechanism"] == NAME)


@pytest.mark.slow
@pytest.mark.long
def test_a_wave_sharpens_the_emulator_of_what_is_hidden(laboratory, tmp_path):
    emulated, rig = laboratory.emulated, laboratory.rig
    measured = laboratory.measure(0, NAME)
    more, own, before = emulator_waves.plan_wave(emulated, measured, rig, 1)
    assert error_of(before) > emulator_waves.SHARE
    rows, specs = plan(rig, emulated.catalogue, list(emulated.settings.experiments))
    metrics = simulate(specs, laboratory.root) | simulate(own, tmp_path)
    trained, _ = train(rows + more, metrics, emulated.settings, emulated.factors)
    refined = Emulated(trained, emulated.settings, emulated.factors, emulated.catalogue)
    assert error_of(emulator_waves.left(refined, measured)) < 0.75 * error_of(before)
