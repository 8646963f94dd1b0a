"""The drop test: single grains fall onto a plate and the height of their rebound is read.

Several grains fall at once, far apart, so that they never meet. Each starts a little higher than
the last, by a fraction of its path in one time step at impact. So their contacts begin at different
moments within a step. The scatter of their rebounds is then what the time step costs. Heights are
those of the lowest point above the plate, as on the bench.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.errors import MeasureError
from dem.experiments import builder, drag, setup
from dem.experiments.declare import Experiment, Lever, LogShare, Metric, Quantity, fall, lever
from dem.experiments.mesh import circle, outside, read_mesh
from dem.grains.sizes import mean_radius
from dem.schema import Part, field, mesh_field
from dem.timescales import hertz_contact_time

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec

APART = 20.0  # radii between grains: they never meet
MISSED = 5e-6  # of the drop height, at an apex between two looks
REBOUND = LogShare("drop_height_mm", 1e-4)  # its least: a grain that sticks has no logarithm


class DropGeometry(Part):
    """Drop test."""

    drop_height_mm: float = field(150.0, "lowest point of the grain above the plate", gt=0)
    drops: int = field(5, "independent drops, at different phases of the time step", ge=1, le=1000)
    output_interval_s: float | None = field(
        None, "read heights at these instants only, as a coarse output would", gt=0
    )
    plate_stl: str | None = mesh_field(
        "mesh [mm] of a target in place of the endless plate: under each grain one of its own, hit "
        "at x = y = z = 0"
    )


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Drop the grains described by `spec`; returns the metrics of docs/architecture.md."""
    g = spec.geometry
    radius, height = mean_radius(spec), 1e-3 * g.drop_height_mm
    impact = math.sqrt(2.0 * GRAVITY * height)
    walls, apart = _targets(spec)
    sim = setup.build_simulation(spec, walls)
    phase = (np.arange(g.drops) + np.random.default_rng(spec.seed).random()) / g.drops
    start = height + phase * impact * sim.time_step
    position = np.column_stack([np.arange(g.drops) * apart, np.zeros(g.drops), radius + start])
    sim.add_particles(position, radius)
    # a restitution of one would come back after three quarters of a whole bounce
    longest = math.sqrt(2.0 * height / GRAVITY)
    density, viscosity = sim.model.air
    if density > 0.0:
        # the time in vacuum and that at terminal speed add up to more than the fall takes
        weight, diameter = GRAVITY * float(sim.mass.min()), 2.0 * float(sim.radius.min())
        longest += height / drag.terminal_speed(weight, diameter, density, viscosity)
    limit = 2.2 * longest
    apex, sampled, hitting, leaving = _follow(
        sim, radius, height, limit, g.output_interval_s, context
    )
    rebound = sampled if g.output_interval_s else apex
    restitution = np.sqrt(np.maximum(apex, 0.0) / start)
    if density > 0.0:  # the air took a part of both speeds
        restitution, impact = leaving / hitting, float(hitting.mean())
    grain, wall = (setup.material_of(m) for m in (spec.materials.particle, spec.materials.wall))
    contact = hertz_contact_time(radius, impact, grain, wall)
    context.finish(sim)
    return {
        "rebound_height_mm": 1e3 * float(rebound.mean()),
        "rebound_height_sd_mm": 1e3 * float(rebound.std(ddof=1)) if g.drops > 1 else 0.0,
        "true_rebound_height_mm": 1e3 * float(apex.mean()),
        "effective_restitution": float(restitution.mean()),
        "effective_restitution_sd": float(restitution.std(ddof=1)) if g.drops > 1 else 0.0,
        "impact_speed_m_s": impact,
        "contact_time_s": contact,
        "steps_per_contact": contact / sim.time_step,
    }


def _targets(spec):
    """Walls under all grains, and the distance of the grains [m], along x."""
    radius, walls = mean_radius(spec), builder.WallSet().body("plate", material=setup.WALL)
    mesh, apart = read_mesh(spec, "plate_stl", outside(2 * [-radius], 2 * [radius])), APART * radius
    if mesh is None:
        return walls.plane((0, 0, 0), (0, 0, 1)), apart
    mesh.covering(circle(radius), "under the grain its surface")
    axis = mesh.covering(circle(0.0), "its surface")
    mesh.in_place("its surface on the z axis", axis, 0.0)
    apart += 2.0 * float(np.abs(mesh.vertices[:, 0]).max())
    for k in range(spec.geometry.drops):
        walls.mesh(mesh.vertices + [k * apart, 0.0, 0.0], mesh.triangles)
    return walls, apart


def _follow(sim, radius, height, limit, output_interval, context):
    """Highest point [m] of each grain (n,) after the first impact at any time, and at output
    instants only, and the speeds at the plate before and after the impact [m/s].

    The apex by energy is z + v^2/2g while the grain rises freely. With air drag the true apex is
    the largest z. So the larger of the heights reached is kept, and the energy estimate is used in
    vacuum only. Raises MeasureError when a grain has not come down within `limit` [s].
    """
    n = sim.n
    highest, sampled = np.full(n, -np.inf), np.full(n, -np.inf)
    landed, bounced, done = (np.zeros(n, bool) for _ in range(3))
    hitting, leaving = np.zeros(n), np.full(n, np.nan)
    before = np.zeros(n)  # velocities at the last look
    # fine enough that the height missed at the apex, g dt^2 / 8, is below this share of the drop
    pause = max(int(math.sqrt(8.0 * MISSED * height / GRAVITY) / sim.time_step), 1)
    if output_interval:
        pause = max(round(output_interval / sim.time_step), 1)
    fine = max(int(math.sqrt(0.8 * MISSED * height / GRAVITY) / sim.time_step), 1)
    steps_to_output = pause
    while sim.time < limit and not done.all():
        step = min(fine, steps_to_output)
        sim.advance(step)
        steps_to_output -= step
        z, v = sim.position[:, 2] - radius, sim.velocity[:, 2]
        landed |= z <= 0.0
        rising = v > 0.0
        slower = (v - before) / (step * sim.time_step)  # acceleration of a free flight
        free = z > 0.0
        falling = free & ~landed & ~bounced & ~rising
        # on to the plate, and back to it, from the look next to the impact
        at_plate = np.sqrt(np.maximum(v * v - 2.0 * slower * z, 0.0))
        hitting = np.where(falling, at_plate, hitting)
        first = free & rising & (before > 0.0) & np.isnan(leaving)
        leaving = np.where(first, at_plate, leaving)
        before = v
        bounced |= rising
        highest = np.where(bounced & ~done, np.maximum(highest, z), highest)
        if steps_to_output == 0:
            sampled = np.where(bounced & ~done, np.maximum(sampled, z), sampled)
            steps_to_output = pause
        # the second fall has begun: nothing higher comes for this grain
        done |= bounced & ~rising & (z < 0.5 * highest)
        context.progress(min(sim.time / limit, 0.99), f"{sim.time:.3f} s")
        context.frame(sim)
    if not (landed | bounced).all():
        asked = "is it too light to fall in this air?"
        raise MeasureError(f"a grain has not reached the plate after {sim.time:.3g} s; {asked}")
    leaving = np.where(np.isnan(leaving), 0.0, leaving)
    return np.maximum(highest, 0.0), np.maximum(sampled, 0.0), hitting, leaving


EXPERIMENT = Experiment(
    name="drop",
    title="Drop test",
    geometry=DropGeometry,
    run=run,
    metrics=(
        Metric("rebound_height_mm", "mean height of the rebound", 0.0, 1e6),
        Metric("rebound_height_sd_mm", "its standard deviation over the drops", 0.0, target=False),
        Metric(
            "true_rebound_height_mm",
            "rebound between the instants of output too",
            0.0,
            target=False,
        ),
        Metric(
            "effective_restitution",
            "speed after over speed before the impact: in a vacuum the "
            "root of rebound over drop height",
            0.0,
            1.1,
        ),
        Metric("effective_restitution_sd", "its standard deviation", 0.0, target=False),
        Metric("impact_speed_m_s", "speed at the impact", 0.0, target=False),
        Metric("contact_time_s", "duration of the elastic impact", 0.0, target=False),
        Metric("steps_per_contact", "time steps in it", 0.0, target=False),
    ),
    # a drop is over in one contact, which must be resolved (44 steps at 1.7 m/s)
    defaults={"numerics": {"rayleigh_fraction": 0.05}},
    prepare=_targets,  # an unusable mesh is refused here
    impact_speed=fall("drop_height_mm"),
    least_steps=20,  # the rebound goes with the square of the restitution
    quantity=Quantity(
        "rebound_height", "mm", 1e-3, 1e4, "rebound", True, below=REBOUND.lever, scale=REBOUND
    ),
    levers=lever("drop_height_mm", 1.0, 1e4, "drop height", needed=True)
    | {"output_interval_s": Lever(1e-6, 10.0, "frame interval", "s", None)},
)
