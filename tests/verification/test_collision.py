"""One contact integrated for the diagnosis: closed forms of its restitution, its flight in air and
its friction."""

import numpy as np
import pytest

from benchmarks.rates.simulated import salt_heap, salt_settings
from calibration.intake.quantities import Condition
from diagnosis.catalogue import load_catalogue
from diagnosis.laws.known import rebounds, sliding_angles
from diagnosis.rig import Rig

HEIGHTS = np.array([60.0, 150.0, 400.0])


def spec(experiment, diameter=2.0, **pair):
    base = salt_heap()
    settings = salt_settings()
    levers = {"particle_diameter_mm": diameter}
    if experiment == "drop":
        levers["drop_height_mm"] = 100.0
    out = Rig(settings, base).spec(Condition(experiment, levers), 0)
    return out | {"contacts": {"particle_wall": pair}}


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.3, 0.6, 0.9])
def test_a_constant_restitution_comes_back_at_every_speed(e):
    share = np.sqrt(rebounds(spec("drop", restitution=e), HEIGHTS) / HEIGHTS)
    assert share == pytest.approx(e, rel=0.004)


@pytest.mark.slow
def test_a_heavy_ball_in_thin_air_rises_as_in_vacuum_and_in_thick_air_less():
    drag = load_catalogue()["air_drag"].apply
    vacuum = rebounds(spec("drop", restitution=0.8), HEIGHTS)
    thin, thick = (rebounds(drag(spec("drop", restitution=0.8), k), HEIGHTS) for k in (1e-4, 2.0))
    assert thin == pytest.approx(vacuum, rel=1e-3)
    assert (np.diff(thick / vacuum) < 0.0).all()


@pytest.mark.slow
def test_a_slide_begins_at_the_angle_of_friction():
    angle = sliding_angles(spec("tilt", static_friction=0.5), [4.0])
    late = np.degrees(np.cbrt(6.0 * 2e-6 * np.cos(np.arctan(0.5)) * np.radians(4.0) ** 2 / 9.81))
    assert angle == pytest.approx(np.degrees(np.arctan(0.5)) + late, abs=0.01)
