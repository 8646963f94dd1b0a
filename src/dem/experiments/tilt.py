"""The tilted plane: four bonded grains rest on a plate that tilts until they slide.

The plate turns at a steady rate about one of its edges. The bonded grains are one rigid body and
cannot roll. As on the bench, sliding is seen when they have moved a given distance along the plate.
The angle is read at that moment.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.errors import MeasureError
from dem.experiments import builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, Tangent, lever, refuse
from dem.experiments.mesh import outside, read_mesh
from dem.grains.sizes import fall_time, longest_mm, mean_radius
from dem.linear import into_axes
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec

SETTLE = 5.0  # fall times that the grains get to come to rest on the level plate
LOOK = 0.2  # fall times between looks at the cluster; the angle is read to tilt rate times this


class TiltGeometry(Part):
    """Tilted plane."""

    tilt_rate_deg_s: float = field(5.0, "speed of tilting", gt=0, le=90)
    plate_length_mm: float = field(80.0, "plate along the slope", gt=0)
    plate_width_mm: float = field(60.0, "plate across the slope", gt=0)
    spacing_mm: float | None = field(
        None, "half distance of bonded grains; touching unless given", gt=0
    )
    slip_mm: float = field(0.05, "movement along the plate that counts as sliding", gt=0)
    plate_stl: str | None = mesh_field(
        "mesh [mm] in place of the smooth plate: its highest points at z = 0, and at least as long "
        "and wide as the keys say about x = y = 0"
    )
    trials: int = field(5, "trials with the cluster turned at random", ge=1, le=100)


def check(spec: "RunSpec") -> None:
    """The bonded cluster must lie on the tilting plate however it is turned."""
    g, largest = spec.geometry, longest_mm(spec)
    half_distance = 0.5 * largest if g.spacing_mm is None else g.spacing_mm
    needed = 2.0 * math.sqrt(2.0) * half_distance + largest
    for key in ("plate_length_mm", "plate_width_mm"):
        if getattr(g, key) < needed:
            refuse(key, spec, f"at least {needed:.4g}, the size of the bonded cluster")


def advice(spec: "RunSpec") -> list[str]:
    """A cluster that may tip before it slides."""
    # tangent of the least tilt at which the weight leaves the square on which the cluster of four
    # stands
    spacing = spec.geometry.spacing_mm
    limit = 1.0 if spacing is None else 1e-3 * spacing / mean_radius(spec)
    friction = spec.contacts.particle_wall.static_friction
    if friction < limit:
        return []
    return [
        f"contacts.particle_wall.static_friction is {friction:g}; from {limit:.2g} on the cluster "
        "may tip before it slides and the angle is not that of friction: raise geometry.spacing_mm"
    ]


def _walls(spec):
    half = 0.5e-3 * np.array([spec.geometry.plate_length_mm, spec.geometry.plate_width_mm])
    walls = builder.WallSet().body("plate", material=setup.WALL)
    mesh = read_mesh(spec, "plate_stl", outside(-half, half))
    if mesh is None:
        return walls.rectangle((0, 0, 0), (half[0], 0, 0), (0, half[1], 0))
    mesh.topped(-half, half, "its surface")
    return walls.mesh(*mesh.body)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Tilt until the cluster slides; returns the metrics of docs/architecture.md."""
    g = spec.geometry
    angles = np.empty(g.trials)
    for trial in range(g.trials):
        angles[trial] = _slide(spec, np.random.default_rng([spec.seed, trial]), context)
        context.progress((trial + 1) / g.trials, f"trial {trial + 1} of {g.trials}")
    return {
        "sliding_angle_deg": float(angles.mean()),
        "sliding_angle_sd_deg": float(angles.std(ddof=1)) if g.trials > 1 else 0.0,
        "sliding_friction": float(math.tan(math.radians(angles.mean()))),
    }


def _slide(spec, rng, context):
    g = spec.geometry
    radius = mean_radius(spec)
    sim = setup.build_simulation(spec, _walls(spec))
    # a square of touching or spaced grains, turned at random in the plane of the plate
    corner = rng.uniform(0.0, 2.0 * math.pi) + math.pi / 4.0 + np.arange(4) * math.pi / 2.0
    arm = math.sqrt(2.0) * (0.5 * (2e-3 * g.spacing_mm if g.spacing_mm else 2.0 * radius))
    centres = np.column_stack([arm * np.cos(corner), arm * np.sin(corner), np.full(4, radius)])
    sim.add_clusters([centres + (0.0, 0.0, 1e-3 * radius)], radius)
    settled = SETTLE * fall_time(spec)
    sim.advance(round(settled / sim.time_step))
    if phases.motion(sim) >= phases.CALM:
        phases.refuse("lying on the level plate", settled, phases.motion(sim), math.nan)
    rate = math.radians(g.tilt_rate_deg_s)
    sim.move_wall("plate", spin=(0.0, rate, 0.0))
    start = _along_plate(sim)
    step = max(round(LOOK * fall_time(spec) / sim.time_step), 1)
    while True:
        sim.advance(step)
        angle = (sim.time - settled) * rate
        if _along_plate(sim) - start > 1e-3 * g.slip_mm:
            context.finish(sim)
            return math.degrees(angle)
        if angle > math.pi / 2:
            asked = "is there adhesion to the plate?"
            raise MeasureError(f"the cluster has not slid at 90 degrees; {asked}")


def _along_plate(sim):
    """Position of the cluster's centre down the slope, in the frame of the plate [m]."""
    w, b = sim.wall_state, sim.walls.index("plate")
    return float(into_axes(w.rotation[b], sim.clusters.position[0] - w.origin[b])[0])


EXPERIMENT = Experiment(
    name="tilt",
    title="Tilted plane",
    geometry=TiltGeometry,
    run=run,
    metrics=(
        Metric("sliding_angle_deg", "mean tilt at which the cluster slides", 0.0, 90.0),
        Metric("sliding_angle_sd_deg", "its standard deviation over the trials", 0.0, target=False),
        Metric("sliding_friction", "its tangent", 0.0, target=False),
    ),
    check=check,
    prepare=_walls,  # an unusable mesh is refused here
    advice=advice,
    quantity=Quantity(
        "sliding_angle", "deg", 0.1, 89.0, "sliding angle", relative=False, scale=Tangent()
    ),
    levers=lever("tilt_rate_deg_s", 1e-3, 90.0, "tilt rate"),
)
