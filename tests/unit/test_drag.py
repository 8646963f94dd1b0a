"""Air drag on a single sphere, from Stokes' range to Newton's."""

import numpy as np
import pytest
from scipy.integrate import quad

from dem.kernel.drag import apply_drag, terminal_speed
from dem.run import run
from dem.spec import parse_spec


class Particles:
    """The two arrays that the drag reads and writes."""

    def __init__(self, speed, radius):
        self.kinetic = np.zeros((1, 8))
        self.kinetic[0, 2], self.kinetic[0, 6] = speed, radius
        self.force = np.zeros((1, 3))


# measured (Re, C_D) of spheres as listed by
# http://www.ma.iup.edu/projects/CalcDEMma/drag/drag07.html
MEASURED = [
    (0.1585, 169.8),
    (3.020, 10.86),
    (15.49, 3.388),
    (144.5, 0.9204),
    (512.9, 0.5623),
    (1000.0, 0.4786),
    (3162.0, 0.4074),
    (8375.0, 0.3981),
    (26480.0, 0.4571),
]


@pytest.mark.parametrize(("reynolds", "coefficient"), MEASURED)
def test_drag_follows_measured_coefficients(reynolds, coefficient):
    density, viscosity, radius = 1.2, 1.8e-5, 0.02
    speed = reynolds * viscosity / (density * 2 * radius)
    particles = Particles(speed, radius)
    apply_drag.py_func(1, particles, density, viscosity)
    area = np.pi * radius**2
    found = -particles.force[0, 2] / (0.5 * density * speed**2 * area)
    assert found == pytest.approx(coefficient, rel=0.12)


DENSITY, DIAMETER, RESTITUTION = 10.0, 1e-3, 0.8


def drop(tmp_path, height):
    """Rebound [mm] of a very light grain that drops by `height` [mm] in air."""
    spec = {
        "experiment": "drop",
        "laws": {"drag": "schiller_naumann"},
        "materials": {"particle": {"density_kg_m3": DENSITY, "shear_modulus_Pa": 1e5}},
        "contacts": {"particle_wall": {"restitution": RESTITUTION}},
        "particles": {"diameter_mm": 1e3 * DIAMETER},
        "geometry": {"drops": 2, "drop_height_mm": height},
    }
    return run(parse_spec(spec), tmp_path)["metrics"]["rebound_height_mm"]


@pytest.mark.slow
def test_a_grain_that_falls_at_terminal_speed_rebounds(tmp_path):
    """As high as the drag lets it rise at `RESTITUTION` of that speed, from whatever height it
    came."""
    mass = DENSITY * np.pi / 6 * DIAMETER**3

    def deceleration(speed):
        reynolds = 1.2 * speed * DIAMETER / 1.8e-5
        drag = 3 * np.pi * 1.8e-5 * DIAMETER * speed * (1 + 0.15 * reynolds**0.687)
        return 9.81 + drag / mass

    start = RESTITUTION * terminal_speed(9.81 * mass, DIAMETER, 1.2, 1.8e-5)
    rise, _ = quad(lambda speed: speed / deceleration(speed), 0.0, start)
    for height in (60.0, 120.0):
        assert drop(tmp_path, height) == pytest.approx(1e3 * rise, rel=0.04)
