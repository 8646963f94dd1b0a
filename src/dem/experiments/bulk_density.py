"""Bulk density, poured and tapped. Grains fall into a cylinder, which is then dropped from a small
height again and again.

Both densities are those of the mass below a level a little under the surface over the cylinder's
volume to there, as a vessel that is struck off flat gives them. The solid fraction is that of the
core, without the order at walls and floor.

A wide vessel can be simulated as a narrower one of the same proportions. Grains lie less densely at
walls and floor, in a layer whose share of the volume goes as one over the width. So the density in
the wide vessel lies between the core's and that of the narrow one:
core + (narrow - core) * narrow diameter / wide diameter."""

import math
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.experiments.mesh import at_rims, circle, read_mesh
from dem.grains.sizes import grain_volume, longest_mm, mean_radius
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

LEAST_WIDTH = 5.0  # of the largest grain: narrower, the walls order all of the bed
LIFT = 1.2  # time in which the vessel is raised, of that in which it falls
CALM = 6.0  # looks that the grains get after each tap
REST = 50.0  # looks that they get after the last, at most
EDGE = 2.0  # mean diameters that the core keeps from wall, floor and surface
SURFACE = 0.95  # of the grains lie below the level at which the vessel is struck off


class BulkDensityGeometry(Part):
    """A cylinder; 3 mm are the drop of the tapping machines of ISO 3953 and ASTM D7481."""

    vessel_diameter_mm: float = field(24.0, "inner diameter of the vessel", gt=0)
    simulated_diameter_mm: float | None = field(
        None,
        "that of the narrower vessel, filled as deep for its width, which is simulated in its "
        "place; null: the vessel itself",
        gt=0,
        exclude_if=lambda value: value is None,
    )
    taps: int = field(20, "drops of the vessel after it was filled", ge=0, le=10000)
    tap_height_mm: float = field(3.0, "height of each drop", gt=0)
    vessel_stl: str | None = mesh_field(
        "mesh [mm] in place of the cylinder: about the z axis, its floor flat at z = 0, and "
        "vessel_diameter_mm wide inside where it is narrowest"
    )


def check(spec: "RunSpec") -> None:
    """The simulated vessel must be wide enough for grains to lie at random and the bed deep enough
    for a core."""
    g, largest = spec.geometry, longest_mm(spec)
    key = "vessel_diameter_mm" if g.simulated_diameter_mm is None else "simulated_diameter_mm"
    wide = getattr(g, key)
    if wide > g.vessel_diameter_mm:
        allowed = f"at most {g.vessel_diameter_mm:g}, the vessel's own (vessel_diameter_mm)"
        refuse(key, spec, allowed)
    if wide < g.vessel_diameter_mm and g.vessel_stl is not None:
        refuse(key, spec, "null beside vessel_stl, which is simulated as it is")
    refuse_narrow(key, spec, LEAST_WIDTH)
    area = math.pi * (0.5e-3 * wide) ** 2
    depth = 1e3 * spec.particles.count * grain_volume(spec) / (0.6 * area)
    if depth < LEAST_WIDTH * largest:
        most = wide * math.sqrt(depth / (LEAST_WIDTH * largest))
        allowed = f"at most {most:.3g}: the grains would lie only {depth:.3g} mm deep"
        narrower = ", or a narrower simulated_diameter_mm" if key == "vessel_diameter_mm" else ""
        refuse(key, spec, f"{allowed}; or more grains{narrower}")


class _Vessel:
    """A cylinder, or a mesh; `radius` is that of its narrowest part [m], `share` that width over
    the vessel's own where a narrower one is simulated."""

    def __init__(self, spec):
        wide = spec.geometry.vessel_diameter_mm
        narrow = spec.geometry.simulated_diameter_mm or wide
        self.radius, self.share = 0.5e-3 * narrow, narrow / wide
        mesh = self.mesh = read_mesh(spec, "vessel_stl", at_rims())
        if mesh:
            self.radius = mesh.narrowest(0.0, mesh.high)
            mesh.agree("its narrowest inside", 2.0 * self.radius, "vessel_diameter_mm")
            mesh.in_place("its floor", mesh.covering(circle(0.95 * self.radius), "its floor"), 0.0)
            mesh.take(spec)

    def walls(self, top: float) -> "WallSet":
        """Vessel, open at `top`; a mesh goes on as a cylinder above its rim while grains are
        filled in."""
        walls = builder.WallSet().body("vessel", material=setup.WALL)
        if self.mesh is None:
            return walls.disc(self.radius).cylinder(self.radius, 0.0, top)
        return self.mesh.extended(walls, top)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, tap, and measure before and after."""
    g, rng = spec.geometry, np.random.default_rng(spec.seed)
    vessel = _Vessel(spec)
    sim = bed.poured(spec, vessel.walls, vessel.radius, 0.0, rng)
    context.progress(0.3, "poured")
    poured, poured_error, poured_solid = _packed(sim, spec, vessel)
    height = 1e-3 * g.tap_height_mm
    fall = math.sqrt(2.0 * height / GRAVITY)
    for tap in range(g.taps):
        # the vessel is raised and falls; it stops dead, the grains do not
        for speed, duration in (
            (height / (LIFT * fall), LIFT * fall),
            (-height / fall, fall),
            (0.0, CALM * phases.look(spec)),
        ):
            sim.move_wall("vessel", velocity=(0.0, 0.0, speed))
            bed.advance_for(sim, duration)
        context.progress(0.3 + 0.7 * (tap + 1) / g.taps, f"tap {tap + 1} of {g.taps}")
        context.frame(sim)
    phases.rest(sim, spec, REST * phases.look(spec), "tapping")
    tapped, tapped_error, tapped_solid = _packed(sim, spec, vessel)
    context.finish(sim, phases.REST)
    return {
        "poured_density_kg_m3": poured,
        "poured_density_error_kg_m3": poured_error,
        "tapped_density_kg_m3": tapped,
        "tapped_density_error_kg_m3": tapped_error,
        "hausner_ratio": tapped / poured,
        "poured_solid_fraction": poured_solid,
        "tapped_solid_fraction": tapped_solid,
    }


def _packed(sim, spec, vessel):
    """Density in the vessel and its standard error [kg/m3], and solid fraction of the core, of a
    bed at rest."""
    position, mass = sim.position - sim.wall_origin("vessel"), sim.mass
    z = position[:, 2]
    level = float(np.sort(z)[int(SURFACE * len(z)) - 1])
    below = vessel.mesh.volume(level) if vessel.mesh else math.pi * vessel.radius**2 * level
    simulated = float(mass[z <= level].sum()) / below
    edge = EDGE * 2.0 * mean_radius(spec)
    core = vessel.radius - edge, edge, level - edge
    solid = bed.solid_fraction(position, sim.radius, sim.cubed_radius, *core)
    volume = 4.0 / 3.0 * math.pi * float(sim.cubed_radius.sum())
    unbounded = solid * float(mass.sum()) / volume
    density = vessel.share * simulated + (1.0 - vessel.share) * unbounded
    parts = _eighths(position, sim.radius, sim.cubed_radius, *core)
    relative = float(parts.std(ddof=1)) / math.sqrt(len(parts)) / solid
    return density, density * relative, solid


def _eighths(position, radius, cube, core, low, high):
    """Solid fraction (8,) of the widest cylinders in the quarters of a core's halves: four beside
    each other touch the core's side and their neighbours."""
    wide, middle, found = core / (1.0 + math.sqrt(2.0)), 0.5 * (low + high), []
    for x, y in product((wide, -wide), repeat=2):
        for ends in ((low, middle), (middle, high)):
            moved = position - (x, y, 0.0)
            found.append(bed.solid_fraction(moved, radius, cube, wide, *ends))
    return np.array(found)


EXPERIMENT = Experiment(
    name="bulk_density",
    title="Bulk density, poured and tapped",
    geometry=BulkDensityGeometry,
    run=run,
    metrics=(
        Metric("poured_density_kg_m3", "mass over volume in the vessel after filling", 0.0),
        Metric("poured_density_error_kg_m3", "its standard error", 0.0, target=False),
        Metric("tapped_density_kg_m3", "mass over volume in the vessel after the taps", 0.0),
        Metric("tapped_density_error_kg_m3", "its standard error", 0.0, target=False),
        Metric("hausner_ratio", "tapped over poured density", 0.5, 2.0),
        Metric("poured_solid_fraction", "of the core, after filling", 0.0, 1.0),
        Metric("tapped_solid_fraction", "of the core, after the taps", 0.0, 1.0),
    ),
    defaults={"particles": {"count": 2000}, "numerics": {"max_time_s": 3.0}},
    check=check,
    prepare=_Vessel,  # an unusable mesh is refused here
    poured=True,
    quantity=Quantity("poured_density", "kg/m³", 1.0, 3e4, "poured bulk density", relative=True),
    levers=lever("vessel_diameter_mm", 1.0, 1e4, "vessel diameter"),
    mechanisms=("cohesion", "rolling_law"),
)
