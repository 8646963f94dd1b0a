"""The time step that a pressed grain bears is shorter the more walls press it and the deeper.

A grain in a square tube touches four walls, each with the tangential stiffness k_t = 8 G* a and the
dashpot c_t = 2 sqrt(5/6) b sqrt(k_t m*), of which c = c_t/(1 + 3.5 c_t dt/m*) acts: that of the
slip which it leaves. Its spin about the tube's axis turns against all four:
m w'/2.5 = -4 (k_t s + c w). With the velocity half a step behind the position, such an oscillator
is stable while (W dt)^2 + 2 C dt < 4, W^2 = 10 k_t/m, C = 10 c/m.

In a square lattice of grains that spin alike the surfaces of two neighbours slide at twice the
speed: W^2 = 20 k_t/m and C = 20 c/m, with m* = m/2.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from dem.advice import pressed_step, pressure_of, warnings_of
from dem.contact.registry import Laws
from dem.experiments.setup import time_step_of
from dem.spec import parse_spec
from scenes import SALT, STEEL, ContactParameters, WallSet, effective, make, mass_of

R, E = 1e-3, 0.5
SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))


def lattice_limit(overlap, restitution=E):
    """That of grains in a square lattice that overlap by `overlap` [m]."""
    return _limit(effective(SALT)[1], R / 2, overlap, 20.0, 0.5, restitution)


def _limit(shear, r_eff, overlap, turning, share_of_mass, restitution):
    m, log = mass_of(R, SALT), math.log(restitution)
    damping = -log / math.hypot(log, math.pi)
    stiff = 8.0 * shear * math.sqrt(r_eff * overlap)
    dashpot = 2.0 * math.sqrt(5.0 / 6.0) * damping * math.sqrt(stiff * share_of_mass * m)

    def beyond(dt):
        acting = dashpot / (1.0 + 3.5 * dashpot * dt / (share_of_mass * m))
        return turning * (stiff * dt * dt + 2.0 * acting * dt) / m - 4.0

    return brentq(beyond, 1e-9, 1.0, xtol=1e-15)


def force_of(overlap, other, r_eff):
    """Hertz's force [N] of an overlap [m]."""
    return 4.0 / 3.0 * effective(SALT, other)[0] * math.sqrt(r_eff) * overlap**1.5


@pytest.mark.parametrize("share", [0.9, 1.1])
@pytest.mark.parametrize(("overlap", "restitution"), [(0.01, 0.5), (0.05, 0.5), (0.01, 0.15)])
def test_a_lattice_trembles_beyond_its_time_step(overlap, restitution, share):
    """Eight by eight grains that four walls hold as hard as they hold each other."""
    n, deep = 8, overlap * R
    line = (np.arange(n) - 0.5 * (n - 1)) * (2.0 * R - deep)
    at_walls = deep * (force_of(deep, SALT, R / 2) / force_of(deep, STEEL, R)) ** (2.0 / 3.0)
    walls = WallSet().body("tube", material="wall")
    for side in SIDES:
        walls.plane((line[-1] + R - at_walls) * np.array(side), -np.array(side))
    dt = share * lattice_limit(deep, restitution)
    sim = make(ContactParameters(restitution, 0.5), walls=walls, dt=dt)
    centres = [(x, y, 0.0) for x in line for y in line]
    sim.add_particles(centres, R, spin=[(0, 0, 0.1)] * len(centres))
    sim.advance(1000)
    spin = np.abs(sim.spin[:, 2]).max()
    assert spin < 1e-3 if share < 1.0 else spin > 10.0


@pytest.mark.parametrize("restitution", [0.15, 0.5, 0.8])
def test_a_spec_is_judged_by_the_lattice(restitution):
    """The overlap is that of Hertz under the pressure on the square about a grain."""
    deep = 0.01 * R
    pressure = force_of(deep, SALT, R / 2) / (2.0 * R) ** 2
    found = pressed_step(R, SALT, ContactParameters(restitution, 0.5), pressure, Laws())
    assert found == pytest.approx(lattice_limit(deep, restitution), rel=1e-9)


def salt(restitution, fraction=0.4, experiment="heap", **geometry):
    """A spec with grains of `SALT`."""
    pair = {"restitution": restitution, "static_friction": 0.5}
    grain = {"density_kg_m3": 1210, "shear_modulus_Pa": 1e7, "poisson_ratio": 0.25}
    return parse_spec(
        {
            "experiment": experiment,
            "materials": {"particle": grain},
            "contacts": {"particle_particle": pair},
            "geometry": geometry,
            "numerics": {"rayleigh_fraction": fraction},
        }
    )


def test_a_step_at_which_grains_tremble_is_warned_of():
    def told(*args, **geometry):
        return [w for w in warnings_of(salt(*args, **geometry)) if "tremble" in w]

    (sentence,) = told(0.15, 0.7)
    better = float(sentence.split()[-1])
    spec = salt(0.15, better)
    contact, pressure = ContactParameters(0.15, 0.5), pressure_of(spec)
    assert time_step_of(spec) <= pressed_step(R, SALT, contact, pressure, Laws())
    assert not told(0.15, better)
    assert not told(0.15)
    assert not told(0.15, 0.7, "drop")
    # a lid presses harder than the bed does
    assert not told(0.4, 0.3, "shear")
    assert told(0.4, 0.3, "shear", normal_stress_kPa=200.0)
