"""What the time step makes of the restitution: head-on collisions of two grains at the step in use,
less the same at a step that is FINE times shorter. It needs no asked value, so it holds under every
law."""

import math

import numpy as np

from dem.constants import GRAVITY
from dem.errors import BlowUpError
from dem.experiments import experiment_of
from dem.experiments.setup import build_simulation, time_step_of
from dem.grains.sizes import smallest_radius
from dem.spec import RunSpec
from dem.walls.builder import WallSet

PAIRS = 16
"""Pairs that collide at once, each begun at another moment within a step: what the step does to one
collision depends on it."""
FINE = 16
APART = 40.0  # radii between pairs
FALL = 10.0  # radii of the fall whose speed is taken where the experiment has no impact
MOST_STEPS = 20_000  # at the step in use


def usual_speed(spec: RunSpec) -> float:
    """Speed [m/s] of the experiment's impact, or of a fall by FALL radii of the smallest grain."""
    impact = experiment_of(spec).impact_speed
    if impact is not None:
        return float(impact(spec))
    return math.sqrt(2.0 * GRAVITY * FALL * smallest_radius(spec))


def restitution_error(spec: RunSpec, speed: float) -> float | None:
    """Restitution [-] of two of the smallest grains that meet at `speed` [m/s] at the time step of
    a `RunSpec`, less that at a step FINE times shorter; None where they do not part."""
    step = time_step_of(spec)
    used, true = (restitution(spec, speed, step / k) for k in (1, FINE))
    return None if used is None or true is None else used - true


def restitution(spec: RunSpec, speed: float, step: float) -> float | None:
    """Mean speed of parting over that of meeting of PAIRS pairs [-]; None where some do not part
    or blow up."""
    numerics = spec.numerics.model_copy(update={"time_step_s": step})
    laws = spec.laws.model_copy(update={"drag": "none"})
    alone = spec.model_copy(update={"numerics": numerics, "laws": laws})
    sim = build_simulation(alone, WallSet(), gravity=(0.0, 0.0, 0.0))
    radius = smallest_radius(spec)
    phase = (np.arange(PAIRS) + 0.5) / PAIRS * speed * step
    centre = np.column_stack([np.arange(PAIRS) * APART * radius, np.zeros(PAIRS)])
    gap = 1e-3 * radius + phase
    low = np.column_stack([centre, -radius - 0.5 * gap])
    high = np.column_stack([centre, radius + 0.5 * gap])
    velocity = np.zeros((2 * PAIRS, 3))
    velocity[:PAIRS, 2], velocity[PAIRS:, 2] = 0.5 * speed, -0.5 * speed
    sim.add_particles(np.vstack([low, high]), radius, velocity=velocity)
    look = max(round(5e-4 * radius / speed / step), 10)
    most = MOST_STEPS * time_step_of(spec)
    while sim.time < most:
        try:
            sim.advance(look)
        except BlowUpError:
            return None
        z, v = sim.position[:, 2], sim.velocity[:, 2]
        apart = z[PAIRS:] - z[:PAIRS] - 2.0 * radius
        parting = v[PAIRS:] - v[:PAIRS]
        if ((apart > 0.1 * gap) & (parting > 0.0)).all():
            return float(parting.mean()) / speed
    return None
