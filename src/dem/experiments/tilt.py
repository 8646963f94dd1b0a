"""The tilted plane: four bonded grains rest on a plate that tilts until they slide.

The plate turns at a steady rate about one of its edges. The bonded grains are one rigid body and cannot roll.
Sliding is seen, as on the bench, once they have moved a given distance along the plate; the angle is read at that
moment.
"""

import math

import numpy as np

from dem.errors import MeasureError
from dem.experiments.setup import WALL, build_simulation, mean_radius
from dem.linear import into_axes
from dem.walls.builder import WallSet

SETTLE = 0.05  # seconds that the grains get to come to rest on the level plate
LOOK = 2e-3  # seconds between looks at the cluster; the angle is read to tilt rate times this


def run(spec, context):
    """Tilt until the cluster slides; returns the metrics of docs/architecture.md."""
    g = spec.geometry
    angles = []
    for trial in range(g.trials):
        angles.append(_slide(spec, np.random.default_rng([spec.seed, trial]), context))
        context.progress((trial + 1) / g.trials, f"trial {trial + 1} of {g.trials}")
    angles = np.array(angles)
    return {
        "sliding_angle_deg": float(angles.mean()),
        "sliding_angle_sd_deg": float(angles.std(ddof=1)) if len(angles) > 1 else 0.0,
        "sliding_friction": float(math.tan(math.radians(angles.mean()))),
    }


def _cluster(radius, spacing, rng):
    """Centres (4, 3) of a square of touching or spaced grains, turned at random in the plane of the plate."""
    half = 0.5 * spacing
    turn = rng.uniform(0.0, 2.0 * math.pi)
    corner = turn + math.pi / 4.0 + np.arange(4) * math.pi / 2.0
    arm = math.sqrt(2.0) * half
    return np.column_stack([arm * np.cos(corner), arm * np.sin(corner), np.full(4, radius)])


def _slide(spec, rng, context):
    g = spec.geometry
    radius = mean_radius(spec)
    width, depth = 0.5e-3 * g.plate_length_mm, 0.5e-3 * g.plate_width_mm
    walls = WallSet().body("plate", material=WALL)
    walls.rectangle((0, 0, 0), (width, 0, 0), (0, depth, 0))
    sim = build_simulation(spec, walls)
    centres = _cluster(radius, 2e-3 * g.spacing_mm if g.spacing_mm else 2.0 * radius, rng)
    sim.add_clusters([centres + (0.0, 0.0, 1e-3 * radius)], radius)
    sim.advance(round(SETTLE / sim.time_step))
    rate = math.radians(g.tilt_rate_deg_s)
    sim.move_wall("plate", spin=(0.0, rate, 0.0))
    start = _along_plate(sim)
    step = max(round(LOOK / sim.time_step), 1)
    while True:
        sim.advance(step)
        angle = (sim.time - SETTLE) * rate
        if _along_plate(sim) - start > 1e-3 * g.slip_mm:
            context.finish(sim)
            return math.degrees(angle)
        if angle > math.pi / 2:
            raise MeasureError(
                "the cluster has not slid at 90 degrees; is there adhesion to the plate?"
            )


def _along_plate(sim):
    """Position of the cluster's centre down the slope, in the frame of the plate [m]."""
    w, b = sim.wall_state, sim.walls.index("plate")
    return float(into_axes(w.rotation[b], sim.clusters.position[0] - w.origin[b])[0])
