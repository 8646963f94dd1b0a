"""Discharge of a silo or hopper: mass flow through an orifice, arches, and the slope that stays.

A cylinder with a flat or conical bottom is filled with its orifice shut and then opened. Grains
that have left are weighed and taken out. Beverloo's law is W = C rho_b sqrt(g) (D - k d)^(5/2) with
C of 0.55 to 0.65 and k about 1.4 (Beverloo, Leniger and van de Velde 1961, Chemical Engineering
Science 15:260).
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.experiments import bed, builder, outflow, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.flow import FREE_FLOW_RATIO, LOOSE, beverloo
from dem.grains.sizes import grain_volume, mean_radius
from dem.io.stl import read_stl
from dem.schema import Part, field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.simulation import Simulation
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

LEAST_WALL = 2.5  # cylinder over orifice: narrower, the wall sets the flow
LEAST_DEPTH = 2.0  # bed over orifice: lower, the flow goes with the depth
RINGS = 8  # of the slope that stays
OUT = 2.0  # mean diameters below the orifice at which a grain has left


class DischargeGeometry(Part):
    """Silo: a cylinder on a flat bottom (90 degrees) or on a cone, or a mesh."""

    silo_diameter_mm: float = field(40.0, "inner diameter of the silo", gt=0)
    orifice_diameter_mm: float = field(16.0, "orifice in the middle of its bottom", gt=0)
    hopper_half_angle_deg: float = field(90.0, "bottom from the vertical; 90 is flat", gt=0, le=90)
    bottom_stl: str | None = field(
        None,
        "mesh [mm] of the bottom in place of the cone: its orifice about z = 0 and as wide as "
        "orifice_diameter_mm says, its rim at the cylinder",
    )


def check(spec: "RunSpec") -> None:
    """Grains must pass the orifice, the silo must be wider than what flows, and full enough."""
    g = spec.geometry
    refuse_narrow("orifice_diameter_mm", spec, FREE_FLOW_RATIO, "arches stop a narrower flow")
    orifice, told = g.orifice_diameter_mm, f"times the orifice ({g.orifice_diameter_mm:g} mm)"
    if g.silo_diameter_mm < LEAST_WALL * orifice:
        refuse("silo_diameter_mm", spec, f"at least {LEAST_WALL:g} {told}")
    area = math.pi * (0.5e-3 * g.silo_diameter_mm) ** 2
    depth = 1e3 * spec.particles.count * grain_volume(spec) / (LOOSE * area)
    if depth < LEAST_DEPTH * orifice:
        widest = g.silo_diameter_mm * math.sqrt(depth / (LEAST_DEPTH * orifice))
        allowed = f"at most {widest:.3g}: the grains would lie only {depth:.3g} mm deep, less than "
        refuse("silo_diameter_mm", spec, f"{allowed}{LEAST_DEPTH:g} {told}; or more grains")


class Silo:
    """Dimensions in SI; the orifice lies at z = 0."""

    def __init__(self, geometry: "DischargeGeometry") -> None:
        self.radius = 0.5e-3 * geometry.silo_diameter_mm
        self.orifice = 0.5e-3 * geometry.orifice_diameter_mm
        self.stl = geometry.bottom_stl
        self.flat = geometry.hopper_half_angle_deg == 90.0 and not self.stl
        rise = math.tan(math.radians(90.0 - geometry.hopper_half_angle_deg))
        self.shoulder = 0.0 if self.flat else (self.radius - self.orifice) * rise
        if self.stl:
            self.mesh = read_stl(self.stl, 1e-3, False)
            self.shoulder = float(self.mesh[0][:, 2].max())

    def walls(self, top: float) -> "WallSet":
        """Shell up to `top`, bottom and gate."""
        walls = builder.WallSet().body("silo", material=setup.WALL)
        if self.stl:
            walls.mesh(*self.mesh)
        else:
            walls.revolved(self.orifice, 0.0, self.radius, self.shoulder)
        walls.cylinder(self.radius, self.shoulder, top)
        return walls.body("gate", material=setup.WALL).disc(self.orifice)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, open, weigh; returns the metrics."""
    silo, rng = Silo(spec.geometry), np.random.default_rng(spec.seed)
    sim = bed.poured(spec, silo.walls, silo.radius, silo.shoulder, rng)
    context.progress(0.3, "filled")
    total, density = float(sim.mass.sum()), bulk_density(sim, spec, silo)
    setup.take_away(sim, "gate")
    below = -OUT * 2.0 * mean_radius(spec)

    def leave():
        grain = sim.grain  # of which a sphere is out, all are
        left = np.isin(grain, grain[sim.position[:, 2] < below])
        gone = float(sim.mass[left].sum())
        sim.remove(sim.tag[left])
        return gone

    times, masses = outflow.watch(sim, spec, leave, context, 0.69)
    context.finish(sim, "nothing leaves any more")
    flow = outflow.steady_flow(times, masses)
    law = beverloo(density, 2.0 * silo.orifice, 2.0 * mean_radius(spec))
    return {
        "mass_flow_g_s": 1e3 * flow,
        "beverloo_constant": flow / law,
        "emptying_time_s": outflow.ended(times, masses),
        "discharged_share": float(masses[-1] / total),
        "arched": int(is_arched(sim, silo, spec)),
        "drained_angle_deg": drained_angle(sim, silo, spec),
        "bulk_density_kg_m3": density,
    }


def bulk_density(sim: "Simulation", spec: "RunSpec", silo: "Silo") -> float:
    """Density of the bed's core above the shoulder and below the surface [kg/m3]."""
    position, edge = sim.position, 3.0 * mean_radius(spec)
    low = silo.shoulder + edge
    high = float(np.sort(position[:, 2])[int(0.95 * len(position)) - 1]) - edge
    if high < low + edge:  # a cone holds nearly all: the whole bed below the surface counts
        low = 0.0
        return float(sim.mass[position[:, 2] < high].sum()) / _volume(silo, high)
    core = silo.radius - edge, low, high
    solid = bed.solid_fraction(position, sim.radius, sim.cubed_radius, *core)
    return solid * spec.materials.particle.density_kg_m3


def _volume(silo, height):
    """Volume of the silo from the orifice to a height [m3]."""
    cone = min(height, silo.shoulder)
    a = silo.orifice
    b = a + (silo.radius - a) * (cone / silo.shoulder if silo.shoulder else 1.0)
    frustum = math.pi * cone * (a * a + a * b + b * b) / 3.0
    return frustum + math.pi * silo.radius**2 * max(height - silo.shoulder, 0.0)


def is_arched(sim: "Simulation", silo: "Silo", spec: "RunSpec") -> bool:
    """Return whether grains stand over the orifice: what hangs there would fall if no arch held
    it."""
    position = sim.position
    out = np.hypot(position[:, 0], position[:, 1])
    over = (out < silo.orifice - mean_radius(spec)) & (position[:, 2] > 0.0)
    return bool(over.any())


def drained_angle(sim: "Simulation", silo: "Silo", spec: "RunSpec") -> float:
    """Slope [deg] of what stays on a flat bottom, from ring to ring; 0 where nothing does."""
    if not silo.flat or not sim.n:
        return 0.0
    position, edge = sim.position, mean_radius(spec)
    out = np.hypot(position[:, 0], position[:, 1])
    low, high = silo.orifice + edge, silo.radius - edge
    profile = bed.surface_profile(out, position[:, 2], sim.radius, low, high, RINGS)
    angle = bed.profile_angle(*profile)
    return angle if math.isfinite(angle) else 0.0


EXPERIMENT = Experiment(
    name="discharge",
    title="Discharge of a silo",
    geometry=DischargeGeometry,
    run=run,
    metrics=(
        Metric("mass_flow_g_s", "steady flow through the orifice", 0.0),
        Metric("beverloo_constant", "flow over rho_b sqrt(g) (D - 1.4 d)^(5/2)", 0.0, target=False),
        Metric("emptying_time_s", "from the opening until the last grain leaves", 0.0),
        Metric("discharged_share", "of the mass", 0.0, 1.0 + 1e-9),
        Metric("arched", "1 where grains stand over the orifice at the end", 0, 1, target=False),
        Metric("drained_angle_deg", "slope that stays on a flat bottom", -90.0, 90.0),
        Metric("bulk_density_kg_m3", "of the bed before the opening", 0.0),
    ),
    defaults={"particles": {"count": 6000}, "numerics": {"max_time_s": 10.0}},
    check=check,
    prepare=lambda spec: Silo(spec.geometry),  # an unusable mesh is refused here
    poured=True,
    walls=lambda spec: Silo(spec.geometry).walls(3e-3 * spec.geometry.silo_diameter_mm),
    quantity=Quantity("mass_flow", "g/s", 1e-4, 1e6, "mass flow", relative=True),
    levers=lever("orifice_diameter_mm", 1.0, 1e4, "orifice", needed=True),
    mechanisms=("cohesion", "rolling_law", "size_bias"),
)
