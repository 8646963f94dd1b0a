"""Bulk density, poured and tapped. Grains fall into a cylinder, which is then dropped from a small
height again and again.

Both densities are those of the mass below a level a little under the surface over the cylinder's
volume to there, as a vessel that is struck off flat gives them. The solid fraction is that of the
core, without the order at walls and floor."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.experiments.declare import (
    COUNT,
    Experiment,
    Lever,
    Metric,
    Quantity,
    refuse,
    refuse_narrow,
)
from dem.experiments.mesh import at_rims, read_mesh
from dem.grains import draw_radii, grain_volume, largest_reach, longest_mm, mean_radius
from dem.lazy import lazily
from dem.part import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet


bed = lazily("dem.experiments.bed")
setup, builder = lazily("dem.experiments.setup"), lazily("dem.walls.builder")
phases = lazily("dem.experiments.phases")

LEAST_WIDTH = 5.0  # of the largest grain: narrower, the walls order all of the bed
LIFT = 1.2  # time in which the vessel is raised, of that in which it falls
CALM = 6.0  # looks that the grains get after each tap
REST = 50.0  # looks that they get after the last, at most
EDGE = 1.5  # mean diameters that the core keeps from wall, floor and surface
SURFACE = 0.95  # of the grains lie below the level at which the vessel is struck off


class BulkDensityGeometry(Part):
    """A cylinder; 3 mm are the drop of the tapping machines of ISO 3953 and ASTM D7481."""

    vessel_diameter_mm: float = field(24.0, "inner diameter of the vessel", gt=0)
    taps: int = field(20, "drops of the vessel after it was filled", ge=0, le=10000)
    tap_height_mm: float = field(3.0, "height of each drop", gt=0)
    vessel_stl: str | None = mesh_field(
        "mesh [mm] in place of the cylinder: about the z axis, its floor flat at z = 0, and "
        "vessel_diameter_mm wide inside where it is narrowest"
    )


def check(spec: "RunSpec") -> None:
    """The vessel must be wide enough for grains to lie at random and the bed deep enough for a
    core."""
    g, largest = spec.geometry, longest_mm(spec)
    refuse_narrow("vessel_diameter_mm", spec, LEAST_WIDTH)
    area = math.pi * (0.5e-3 * g.vessel_diameter_mm) ** 2
    depth = 1e3 * spec.particles.count * grain_volume(spec) / (0.6 * area)
    if depth < LEAST_WIDTH * largest:
        most = g.vessel_diameter_mm * math.sqrt(depth / (LEAST_WIDTH * largest))
        allowed = f"at most {most:.3g}: the grains would lie only {depth:.3g} mm deep"
        refuse("vessel_diameter_mm", spec, f"{allowed}; or more grains")


class _Vessel:
    """A cylinder, or a mesh; `radius` is that of its narrowest part [m]."""

    def __init__(self, spec):
        self.radius = 0.5e-3 * spec.geometry.vessel_diameter_mm
        self.mesh = read_mesh(spec, "vessel_stl", at_rims())
        if self.mesh:
            self.radius = self.mesh.narrowest(0.0, self.mesh.high)
            self.mesh.agree("its narrowest inside", 2.0 * self.radius, "vessel_diameter_mm")
            floor = self.mesh.floor(0.95 * self.radius, "its floor")
            self.mesh.in_place("its floor", floor, 0.0)
            self.mesh.take(spec)

    def walls(self, top: float) -> "WallSet":
        """Vessel, open at `top`; a mesh goes on as a cylinder above its rim while grains are
        filled in."""
        walls = builder.WallSet().body("vessel", material=setup.WALL)
        if self.mesh is None:
            return walls.disc(self.radius).cylinder(self.radius, 0.0, top)
        return self.mesh.extended(walls, top)

    def volume(self, level: float) -> float:
        """Volume below a level [m3]."""
        if self.mesh is None:
            return math.pi * self.radius**2 * level
        return self.mesh.volume(level)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, tap, and measure before and after."""
    g, rng = spec.geometry, np.random.default_rng(spec.seed)
    vessel, reach = _Vessel(spec), largest_reach(spec)
    radii = draw_radii(spec, spec.particles.count, rng)
    sites = bed.sites_in_circle(vessel.radius, reach, rng)
    sim = bed.poured(spec, vessel.walls, radii, sites, 0.0, rng)
    context.progress(0.3, "poured")
    poured = _density(sim, vessel), _packing(sim, spec, vessel.radius)
    for tap in range(g.taps):
        _tap(sim, spec)
        context.progress(0.3 + 0.7 * (tap + 1) / g.taps, f"tap {tap + 1} of {g.taps}")
        context.frame(sim)
    phases.rest(sim, spec, REST * phases.look(spec), "tapping")
    tapped = _density(sim, vessel), _packing(sim, spec, vessel.radius)
    context.finish(sim)
    return {
        "poured_density_kg_m3": poured[0],
        "tapped_density_kg_m3": tapped[0],
        "hausner_ratio": tapped[0] / poured[0],
        "poured_solid_fraction": poured[1],
        "tapped_solid_fraction": tapped[1],
    }


def _tap(sim, spec):
    """Raise the vessel and let it fall; it stops dead, the grains do not."""
    height = 1e-3 * spec.geometry.tap_height_mm
    fall = math.sqrt(2.0 * height / GRAVITY)
    sim.move_wall("vessel", velocity=(0.0, 0.0, height / (LIFT * fall)))
    bed.advance_for(sim, LIFT * fall)
    sim.move_wall("vessel", velocity=(0.0, 0.0, -height / fall))
    bed.advance_for(sim, fall)
    sim.move_wall("vessel", velocity=(0.0, 0.0, 0.0))
    bed.advance_for(sim, CALM * phases.look(spec))


def _above_floor(sim):
    return sim.position - sim.wall_origin("vessel")


def _density(sim, vessel):
    """Mass below the struck level over the volume to there [kg/m3]."""
    z, mass = _above_floor(sim)[:, 2], sim.mass
    level = float(np.sort(z)[int(SURFACE * len(z)) - 1])
    return float(mass[z <= level].sum()) / vessel.volume(level)


def _packing(sim, spec, radius):
    """Solid fraction of the core."""
    position, edge = _above_floor(sim), EDGE * 2.0 * mean_radius(spec)
    level = float(np.sort(position[:, 2])[int(SURFACE * len(position)) - 1])
    core = radius - edge, edge, level - edge
    return bed.solid_fraction(position, sim.radius, sim.cubed_radius, *core)


EXPERIMENT = Experiment(
    name="bulk_density",
    title="Bulk density, poured and tapped",
    geometry=BulkDensityGeometry,
    run=run,
    metrics=(
        Metric("poured_density_kg_m3", "mass over volume after filling", 0.0),
        Metric("tapped_density_kg_m3", "mass over volume after the taps", 0.0),
        Metric("hausner_ratio", "tapped over poured density", 0.5, 2.0),
        Metric("poured_solid_fraction", "of the core, after filling", 0.0, 1.0),
        Metric("tapped_solid_fraction", "of the core, after the taps", 0.0, 1.0),
    ),
    defaults={"particles": {"count": 2000}, "numerics": {"max_time_s": 3.0}},
    check=check,
    prepare=_Vessel,  # an unusable mesh is refused here
    bonded=True,
    poured=True,
    quantity=Quantity("poured_density", "kg/m³", 1.0, 3e4, "poured bulk density", relative=True),
    levers=COUNT
    | {
        "vessel_diameter_mm": Lever(
            1.0, 1e4, "vessel diameter", "mm", ("geometry", "vessel_diameter_mm")
        ),
    },
    mechanisms=("cohesion", "rolling_law"),
)
