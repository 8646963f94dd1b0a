"""Bonded grains are thrown along a plate; friction stops them after v^2 / (2 mu g)."""

import numpy as np

from dem.constants import GRAVITY
from dem.errors import MeasureError
from dem.experiments.declare import Experiment, Lever, Metric, Quantity, refuse
from dem.experiments.setup import WALL, build_simulation
from dem.grains.sizes import mean_radius
from dem.schema import Part, field
from dem.walls.builder import WallSet


class ThrowGeometry(Part):
    """A plate, and the speed at which the grains set out."""

    launch_speed_m_s: float = field(0.3, "speed along the plate", gt=0)
    plate_length_mm: float = field(200.0, "path that the plate offers", gt=0)


def stopping_distance(spec):
    """Closed form [m]; friction is that of grain on wall."""
    friction = max(spec.contacts.particle_wall.static_friction, 1e-3)
    return spec.geometry.launch_speed_m_s**2 / (2.0 * friction * GRAVITY)


def check(spec):
    """Refuse a plate on which the grains cannot even lie."""
    needed = 4e3 * mean_radius(spec)
    if spec.geometry.plate_length_mm < needed:
        refuse("plate_length_mm", spec, f"at least {needed:g}, the size of the bonded grains")


def advice(spec):
    """Warn of a plate that ends before the grains stop."""
    if 1e3 * stopping_distance(spec) < spec.geometry.plate_length_mm:
        return []
    return ["the grains slide off before they stop: raise geometry.plate_length_mm"]


def run(spec, context):
    """Throw; returns the metrics."""
    radius, speed = mean_radius(spec), spec.geometry.launch_speed_m_s
    walls = WallSet().body("plate", material=WALL).plane((0, 0, 0), (0, 0, 1))
    sim = build_simulation(spec, walls)
    turn = np.pi / 4 + np.arange(4) * np.pi / 2
    arm = np.sqrt(2.0) * radius
    height = np.full(4, radius)
    corners = np.column_stack([arm * np.cos(turn), arm * np.sin(turn), height])
    sim.add_clusters([corners], radius, velocity=[[speed, 0.0, 0.0]])
    limit = 4.0 * stopping_distance(spec) / speed + 0.05
    while np.abs(sim.clusters.velocity[0, 0]) > 1e-3 * speed:
        sim.advance(max(round(1e-3 / sim.time_step), 1))
        context.progress(min(sim.time / limit, 0.99), f"{sim.time:.3f} s")
        if sim.time > limit:
            raise MeasureError("the grains do not stop")
    context.finish(sim)
    return {"stopping_distance_mm": 1e3 * float(sim.clusters.position[0, 0])}


EXPERIMENT = Experiment(
    name="throw",
    title="Thrown grains",
    geometry=ThrowGeometry,
    run=run,
    metrics=(Metric("stopping_distance_mm", "path until the grains rest", 0.0),),
    check=check,
    advice=advice,
    quantity=Quantity("stopping_distance", "mm", 1e-3, 1e5, "stopping distance", relative=True),
    levers={
        "launch_speed_m_s": Lever(
            1e-3, 10.0, "launch speed", "m/s", ("geometry", "launch_speed_m_s"), needed=True
        ),
    },
    mechanisms=("stress_dependent_friction",),
)
