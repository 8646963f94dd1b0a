"""The lifted cylinder. Grains rest in an open cylinder on a plate. The cylinder is lifted, and they
spread to a heap.

Angle, height and coverage are measured as those of the funnel heap; what runs off the plate is
lost.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.experiments.mesh import at_rims, circle, read_mesh
from dem.grains.sizes import longest_mm
from dem.measure.heap import LOST_BELOW, read_at_rest, slopes_of, standing, take_lost
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

LEAST_WIDTH = 5.0  # of the largest grain


class LiftedCylinderGeometry(Part):
    """Cylinder and plate."""

    cylinder_diameter_mm: float = field(24.0, "inner diameter of the cylinder", gt=0)
    plate_diameter_mm: float = field(100.0, "base plate", gt=0)
    lift_speed_mm_s: float = field(50.0, "speed at which the cylinder is lifted", gt=0)
    cylinder_stl: str | None = mesh_field(
        "mesh [mm] of a tube in place of the cylinder: about the z axis, its lower rim at z = 0, "
        "and cylinder_diameter_mm wide inside where it is narrowest"
    )


def check(spec: "RunSpec") -> None:
    """Grains must pass each other in the cylinder, and find room outside it."""
    g, largest = spec.geometry, longest_mm(spec)
    refuse_narrow("cylinder_diameter_mm", spec, LEAST_WIDTH)
    least = g.cylinder_diameter_mm + 4.0 * largest
    if g.plate_diameter_mm < least:
        allowed = f"at least {least:g}: the cylinder and four of the largest grain"
        refuse("plate_diameter_mm", spec, allowed)


class Rig:
    """Cylinder, or a mesh in its place, and plate; `radius` is that of the narrowest part [m]."""

    def __init__(self, spec: "RunSpec") -> None:
        self.radius = 0.5e-3 * spec.geometry.cylinder_diameter_mm
        self.plate = 0.5e-3 * spec.geometry.plate_diameter_mm
        mesh = self.mesh = read_mesh(spec, "cylinder_stl", at_rims(low=True))
        if mesh is None:
            return
        mesh.in_place("its lower rim", mesh.low, 0.0)
        self.radius = mesh.narrowest(0.0, mesh.high)
        mesh.agree("its narrowest inside", 2.0 * self.radius, "cylinder_diameter_mm")
        if np.isfinite(mesh.heights(circle(0.95 * self.radius))).any():
            mesh.refuse("has a floor or a lid, with which it would lift the grains; open both ends")
        if np.hypot(*mesh.vertices[:, :2].T).max() > self.plate:
            mesh.refuse("is wider than the plate; widen geometry.plate_diameter_mm")
        mesh.take(spec)

    def walls(self, top: float) -> "WallSet":
        """Plate, and cylinder up to `top` [m]."""
        walls = builder.WallSet().body("plate", material=setup.WALL).disc(self.plate)
        walls.body("cylinder", material=setup.WALL)
        if self.mesh is None:
            return walls.cylinder(self.radius, 0.0, top)
        return self.mesh.extended(walls, top)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, lift, and measure the heap. Raises MeasureError where none stands."""
    rng, rig = np.random.default_rng(spec.seed), Rig(spec)
    sim = bed.poured(spec, rig.walls, rig.radius, 0.0, rng)
    depth = float(sim.position[:, 2].max())
    lost, ended = _lift(sim, spec, context, depth, rig.plate)
    context.finish(sim, ended)
    found, covered = read_at_rest(sim, context, rig.plate)
    del found["radial_angle_sd_deg"]
    return found | {
        "spilled": lost,
        "plate_coverage": covered,
        "base_radius_mm": 1e3 * base_radius(sim.position, rig.plate),
        "column_depth_mm": 1e3 * depth,
        "rest_time_s": sim.time,
    }


def _lift(sim, spec, context, depth, plate):
    """Lift the cylinder clear of the grains and wait until their slopes stand; returns the grains
    that ran off, and why it ended."""
    speed, lost, slopes = 1e-3 * spec.geometry.lift_speed_mm_s, 0, phases.Slopes(spec)
    start, clear = sim.time, 1.2 * depth / speed
    sim.move_wall("cylinder", velocity=(0.0, 0.0, speed))
    while sim.time - start < clear + spec.numerics.max_time_s:
        bed.advance_for(sim, 2.0 * phases.look(spec))
        lost += take_lost(sim, -LOST_BELOW * plate)
        gone = sim.time - start
        ended = gone > clear and slopes.ended(sim, lambda: slopes_of(standing(sim, plate)))
        if ended:
            return lost, ended
        context.progress(min(gone / (clear + 0.3), 0.99), f"{sim.time:.2f} s")
        context.frame(sim)
    phases.refuse("lifting", sim.time - start - clear, phases.motion(sim), math.nan, phases.RESTS)


def base_radius(position: np.ndarray, plate: float) -> float:
    """Radius [m] within which 95 % of the grains on the plate lie. position (n, 3), plate [m]."""
    out = np.sort(np.hypot(position[:, 0], position[:, 1]))
    return min(float(out[int(0.95 * len(out)) - 1]), plate)


EXPERIMENT = Experiment(
    name="lifted_cylinder",
    title="Lifted cylinder",
    geometry=LiftedCylinderGeometry,
    run=run,
    metrics=(
        Metric("angle_of_repose_deg", "mean slope of the silhouettes' flanks", 0.0, 90.0),
        Metric("angle_of_repose_sd_deg", "its scatter over the flanks", 0.0, target=False),
        Metric("radial_angle_deg", "slope of the surface averaged over the azimuth", 0.0, 90.0),
        Metric("height_mm", "highest point above the plate", 0.0),
        Metric("on_plate", "grains in the heap", 0),
        Metric("spilled", "grains that ran off the plate", 0),
        Metric("plate_coverage", "share of the plate that lies under grains", 0.0, 1.0),
        Metric("base_radius_mm", "radius within which 95 % of the grains lie", 0.0),
        Metric("column_depth_mm", "depth of the grains before the lift", 0.0, target=False),
        Metric("rest_time_s", "time until its slopes stood", 0.0, target=False),
    ),
    defaults={"particles": {"count": 3000}, "numerics": {"max_time_s": 3.0}},
    check=check,
    prepare=Rig,  # an unusable mesh is refused here
    poured=True,
    walls=lambda spec: Rig(spec).walls(1e-3 * spec.geometry.cylinder_diameter_mm),
    heap_plate=lambda spec: 0.5e-3 * spec.geometry.plate_diameter_mm,
    quantity=Quantity("angle_of_repose", "deg", 0.1, 89.0, "angle of repose", relative=False),
    levers=lever("lift_speed_mm_s", 0.1, 1e4, "lift speed"),
    mechanisms=("cohesion", "rolling_law", "grain_shape", "size_bias"),
)
