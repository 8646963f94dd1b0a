"""Air drag on a single sphere, from Stokes' range to Newton's."""

import numpy as np
import pytest

from dem.drag import apply_drag


class Particles:
    """The two arrays that the drag reads and writes."""

    def __init__(self, speed, radius):
        self.kinetic = np.zeros((1, 8))
        self.kinetic[0, 2], self.kinetic[0, 6] = speed, radius
        self.force = np.zeros((1, 3))


# measured (Re, C_D) of spheres as listed by http://www.ma.iup.edu/projects/CalcDEMma/drag/drag07.html
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
