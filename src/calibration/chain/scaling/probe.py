"""What one contact does when it is enlarged: mass, weight, force, stiffness and damping, measured
in the engine.

A grain is pressed into a plate by a fixed share of its radius, at rest and with a small speed, and
the force on the plate is read. The exponents of these quantities are what the paper's Eqs. 4 to 6
and 15 state.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.constants import GRAVITY
from dem.experiments.setup import build_simulation
from dem.grains import mean_radius
from dem.materials import WALL
from dem.spec import parse_spec
from dem.walls.builder import WallSet

OVERLAP = 0.01  # of the radius
STRETCH = 1e-3  # of the overlap: the step of the stiffness
SPEED = 1e-3  # of the overlap over the Rayleigh time step: small beside the elastic force


def probe(run: dict[str, Any]) -> dict[str, float]:
    """Mass [kg], weight, force [N], stiffness [N/m] and damping coefficient [kg/s] of a grain on
    the plate.

    `run` is a run spec of the drop, without experiment and seed.
    """
    spec = parse_spec(run | {"experiment": "drop", "numerics": {"precision": "double"}})
    radius = mean_radius(spec)
    force, mass, step = _force(spec, radius, OVERLAP * radius, 0.0)
    more = _force(spec, radius, OVERLAP * radius * (1.0 + STRETCH), 0.0)[0]
    speed = SPEED * OVERLAP * radius / step
    moving = _force(spec, radius, OVERLAP * radius, speed)[0]
    return {
        "mass": mass,
        "weight": mass * GRAVITY,
        "force": force,
        "stiffness": (more - force) / (STRETCH * OVERLAP * radius),
        "damping_coefficient": (moving - force) / speed,
    }


def _force(spec, radius, overlap, speed):
    """Force on the plate [N], the grain's mass [kg] and the time step [s]; speed of approach
    [m/s]."""
    walls = WallSet().body("plate", material=WALL).plane((0, 0, 0), (0, 0, 1))
    sim = build_simulation(spec, walls, gravity=(0.0, 0.0, 0.0))
    sim.add_particles([[0.0, 0.0, radius - overlap]], radius, velocity=[[0.0, 0.0, -speed]])
    sim.advance(1)
    return abs(float(sim.wall_force("plate")[2])), float(sim.mass[0]), sim.time_step


def measured_exponents(runs: Mapping[float, dict[str, Any]]) -> dict[str, float]:
    """{quantity: exponent of h} over {h: run spec}, by a straight line through the logarithms."""
    found = {h: probe(run) for h, run in runs.items()}
    scale = np.log(list(found))
    return {
        quantity: float(np.polyfit(scale, np.log([f[quantity] for f in found.values()]), 1)[0])
        for quantity in next(iter(found.values()))
    }
