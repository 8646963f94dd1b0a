"""The funnel heap (injection method): grains fall through a funnel onto a disc and their angle of
repose is measured.

Grains are made in the funnel's mouth at the given rate, run out through the orifice, and what
passes the rim of the plate falls away. The run ends when the heap is at rest or its slopes stand.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from dem.errors import MeasureError, RefusedStateError, SpecError
from dem.experiments import builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, fall, lever, refuse, refuse_narrow
from dem.flow import C_BEVERLOO, FREE_FLOW_RATIO, LOOSE, beverloo
from dem.grains.sizes import draw_radii, grain_volume, largest_reach, mean_radius
from dem.io.stl import read_stl
from dem.measure.heap import LOST_BELOW, read_at_rest, slopes_of, standing, take_lost
from dem.schema import Part, field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.simulation import Simulation
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

MIN_ORIFICE_RATIO = 3.0  # orifice over largest grain; below it any funnel clogs
LEAST_PLATE = 4.0  # plate over largest grain
MOUTH_ABOVE_RIM = 0.25  # where grains are made, above the funnel's rim: radii of its mouth
COLLAR = 2.5  # height of the wall above the rim, in the same
FULL = 0.5  # share of the places in the mouth below which a funnel is full
MOST_LEFT = 0.05
"""Share of the grains that may stay in the funnel: a heap of 5 % less volume is 2 % lower and as
steep."""

LEAST_COVERAGE = 0.25
"""Share of the plate that must lie under grains: that of a heap of half the plate's diameter.
Below, they lie about."""

PACKING = 0.6  # solid fraction above the orifice
NEAR_CAPACITY = 0.3  # feed within this share of the capacity: heaps come in two kinds
AT_ORIFICE = 0.2  # radii of the orifice; grains this far below it have not left it
JITTER = 0.09  # of half a grain's length: grains are made on a lattice, moved at random


class HeapGeometry(Part):
    """Funnel and plate."""

    orifice_diameter_mm: float = field(20.0, "orifice of the funnel", gt=0)
    plate_diameter_mm: float = field(80.0, "base plate", gt=0)
    discharge_height_mm: float = field(75.0, "orifice above the plate", gt=0)
    funnel_half_angle_deg: float = field(30.0, "flank from the vertical", gt=0, lt=90)
    funnel_top_diameter_mm: float = field(80.0, "mouth of the funnel", gt=0)
    generation_rate_per_s: float = field(5000.0, "grains made per second", gt=0)
    injection_speed_m_s: float = field(0.3, "downward speed of new grains", gt=0)
    feed: Literal["rain", "opened"] = field(
        "rain", "grains rain through the open funnel, or fill it closed and it is then opened"
    )
    plate_rim_height_mm: float = field(0.0, "rim around the plate; the heap stands above it", ge=0)
    funnel_stl: str | None = field(None, "mesh [mm] in place of the analytic funnel")
    plate_stl: str | None = field(None, "mesh [mm] in place of the analytic plate")
    meshes: Literal["closed", "open"] = field(
        "closed", "whether meshes may have free edges, as a dish or a funnel of no thickness has"
    )


def check(spec: "RunSpec") -> None:
    """Grains must pass the funnel and find a plate, and the time must suffice to make them. Raises
    SpecError."""
    g = spec.geometry
    refuse_narrow("orifice_diameter_mm", spec, MIN_ORIFICE_RATIO)
    if g.funnel_top_diameter_mm <= g.orifice_diameter_mm:
        allowed = f"more than the orifice ({g.orifice_diameter_mm:g} mm)"
        refuse("funnel_top_diameter_mm", spec, allowed)
    refuse_narrow("plate_diameter_mm", spec, LEAST_PLATE)
    if g.plate_rim_height_mm >= g.discharge_height_mm:
        allowed = f"less than the orifice's height ({g.discharge_height_mm:g} mm)"
        refuse("plate_rim_height_mm", spec, allowed)
    low, high = 0.5 * g.orifice_diameter_mm, 0.5 * g.funnel_top_diameter_mm
    slope = math.tan(math.radians(g.funnel_half_angle_deg))
    room = math.pi / 3.0 * (high**3 - low**3) / slope  # [mm3] below the rim, of a closed funnel
    fits = int(LOOSE * 1e-9 * room / grain_volume(spec))
    if g.feed == "opened" and spec.particles.count > fits:
        allowed = f"at most {fits}, which the closed funnel takes"
        wider = "or a wider geometry.funnel_top_diameter_mm"
        raise SpecError("particles.count", spec.particles.count, f"{allowed}, {wider}")
    pouring = spec.particles.count / g.generation_rate_per_s
    if spec.numerics.max_time_s <= pouring:
        allowed = f"more than the {pouring:g} s in which particles.count grains are made"
        raise SpecError("numerics.max_time_s", spec.numerics.max_time_s, allowed)


def capacity(spec: "RunSpec") -> float:
    """Grains per second that the orifice passes, by Beverloo: C rho_b sqrt(g) (D - k d)^(5/2) over
    a grain's mass.

    d is the diameter of the mean grain; 0 where the orifice is narrower than k d.
    """
    orifice = 1e-3 * spec.geometry.orifice_diameter_mm
    return solid_rate(orifice, 2.0 * mean_radius(spec)) / grain_volume(spec)


def solid_rate(orifice: float, diameter: float) -> float:
    """Volume of grains per second [m3/s] that an orifice [m] passes, by Beverloo; diameter of the
    mean grain [m]."""
    return C_BEVERLOO * beverloo(PACKING, orifice, diameter)


def advice(spec: "RunSpec") -> list[str]:
    """An orifice at which grains arch, and a feed at which the funnel fills up or not by chance."""
    g, found = spec.geometry, []
    ratio = 0.5e-3 * g.orifice_diameter_mm / largest_reach(spec)
    if ratio < FREE_FLOW_RATIO:
        told = f"is {ratio:.1f} of the largest grain; below {FREE_FLOW_RATIO:g} the funnel may clog"
        found.append(f"geometry.orifice_diameter_mm {told}")
    passes, feed = capacity(spec), g.generation_rate_per_s
    if g.feed == "rain" and abs(passes / feed - 1.0) < NEAR_CAPACITY:
        found.append(
            f"the orifice passes about {passes:.0f} grains/s by Beverloo and {feed:.0f} are made: "
            f"within {NEAR_CAPACITY:.0%} the funnel packs in some runs and not in others, and the "
            "angles differ; lower geometry.generation_rate_per_s below "
            f"{(1 - NEAR_CAPACITY) * passes:.0f}, or set geometry.feed: opened"
        )
    return found


class Rig:
    """Dimensions of the rig in SI, from the spec's geometry."""

    def __init__(self, geometry: "HeapGeometry") -> None:
        g = geometry
        self.orifice_radius = 0.5e-3 * g.orifice_diameter_mm
        self.plate_radius = 0.5e-3 * g.plate_diameter_mm
        self.orifice_height = 1e-3 * g.discharge_height_mm
        self.mouth_radius = 0.5e-3 * g.funnel_top_diameter_mm
        slope = math.tan(math.radians(g.funnel_half_angle_deg))
        self.rim_height = self.orifice_height + (self.mouth_radius - self.orifice_radius) / slope
        self.source_height = self.rim_height + MOUTH_ABOVE_RIM * self.mouth_radius
        self.collar_height = self.rim_height + COLLAR * self.mouth_radius
        self.lost_height = -LOST_BELOW * self.plate_radius
        self.left_height = self.orifice_height - AT_ORIFICE * self.orifice_radius
        self.plate_rim = 1e-3 * g.plate_rim_height_mm
        self.opened = g.feed == "opened"
        self.funnel_stl, self.plate_stl = g.funnel_stl, g.plate_stl
        self.closed_meshes = g.meshes == "closed"

    def walls(self) -> "WallSet":
        """Plate and funnel, as analytic surfaces or as the meshes that the spec names [mm in the
        file]."""
        walls = builder.WallSet().body("plate", material=setup.WALL)
        if self.plate_stl:
            walls.mesh(*read_stl(self.plate_stl, 1e-3, self.closed_meshes))
        else:
            walls.disc(self.plate_radius)
        if self.plate_rim:
            walls.cylinder(self.plate_radius, 0.0, self.plate_rim)
        walls.body("funnel", material=setup.WALL)
        if self.funnel_stl:
            walls.mesh(*read_stl(self.funnel_stl, 1e-3, self.closed_meshes))
        else:
            low, high = (self.orifice_radius, self.orifice_height), self.rim_height
            walls.frustum(*low, self.mouth_radius, high)
        # a collar above the funnel keeps the falling grains in, whatever the funnel is made of
        walls.body("collar", material=setup.WALL)
        walls.cylinder(self.mouth_radius, self.rim_height, self.collar_height)
        if self.opened:
            walls.body("gate", material=setup.WALL).disc(self.orifice_radius, self.orifice_height)
        return walls


class Source:
    """Makes grains layer by layer in the mouth of the funnel."""

    def __init__(self, spec: "RunSpec", rig: "Rig", rng: np.random.Generator) -> None:
        self.spec, self.rng, self.made = spec, rng, 0
        self.radii = draw_radii(spec, spec.particles.count, rng)
        self.speed = spec.geometry.injection_speed_m_s
        r = largest_reach(spec)
        self.pitch = 2.2 * r
        line = np.arange(-rig.mouth_radius + 1.1 * r, rig.mouth_radius - r, self.pitch)
        x, y = np.meshgrid(line, line, indexing="ij")
        inside = np.hypot(x, y) < rig.mouth_radius - 1.2 * r
        self.sites = np.column_stack([x[inside], y[inside]])
        self.height, self.opened = rig.source_height, rig.opened
        self.jitter = JITTER * r
        # a layer leaves room for the next after it has fallen by one pitch
        self.interval = self.pitch / self.speed
        rate = spec.geometry.generation_rate_per_s
        self.per_layer = min(max(round(rate * self.interval), 1), len(self.sites))
        self.interval = max(self.interval, self.per_layer / rate)

    @property
    def exhausted(self) -> bool:
        """Return whether all grains are made."""
        return self.made == len(self.radii)

    def free_sites(self, sim: "Simulation") -> np.ndarray:
        """Where grains can be made (m, 2) [m]: those places that no grain stands in. A funnel that
        grains run out of is full when half of them are taken, and waits; in a closed one the rest
        of the mouth is filled all the same."""
        position = sim.particles.position[: sim.n, :3]
        high = position[position[:, 2] > self.height - 0.9 * self.pitch, :2]
        if not len(high):
            return self.sites
        gaps = np.hypot(*(self.sites[:, None] - high).transpose(2, 0, 1)).min(axis=1)
        free = self.sites[gaps > self.pitch]
        full = not self.opened and len(free) < FULL * len(self.sites)
        return self.sites[:0] if full else free

    def make_layer(self, sim: "Simulation") -> bool:
        """Add one layer where grains do not stand in its way; True when one was made."""
        sites = self.free_sites(sim)
        count = min(self.per_layer, len(self.radii) - self.made, len(sites))
        if not count:
            return False
        site = sites[self.rng.choice(len(sites), count, replace=False)]
        shift = self.rng.uniform(-self.jitter, self.jitter, (count, 3))
        position = np.column_stack([site, np.full(count, self.height)]) + shift
        velocity = np.tile([0.0, 0.0, -self.speed], (count, 1))
        radii = self.radii[self.made : self.made + count]
        setup.add_grains(sim, self.spec, position, radii, velocity, self.rng)
        self.made += count
        return True


def grains_above(sim: "Simulation", height: float) -> int:
    """Number of grains of which a sphere's centre is above `height` [m]."""
    high = sim.particles.position[: sim.n, 2] > height
    cluster = sim.particles.cluster[: sim.n][high]
    return int((cluster < 0).sum()) + len(np.unique(cluster[cluster >= 0]))


def flow_of(record: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Most grains in the funnel at once, time of the last that left it [s], and the mean rate [1/s]
    at which the middle four fifths of those that left did so.

    record: rows of time [s], grains made so far and grains above the orifice.
    """
    time, made, held = np.array(record, float).T
    out = made - held
    total, found = out[-1], {"hold_up": int(held.max())}
    if total <= 0:
        return found | {"emptying_time_s": 0.0, "discharge_rate_per_s": 0.0}
    last, begin, end = (int(np.argmax(out >= share * total)) for share in (1.0, 0.1, 0.9))
    span = time[end] - time[begin]
    rate = (out[end] - out[begin]) / span if span > 0.0 else total / time[last]
    return found | {"emptying_time_s": float(time[last]), "discharge_rate_per_s": float(rate)}


def pour(spec: "RunSpec", context: "RunContext") -> "tuple[Simulation, Rig, int, list, str]":
    """Build the heap described by `spec` and wait until its slopes stand. Returns the simulation,
    the rig, the grains spilled, the record for `flow_of`, and why it ended. Raises
    RefusedStateError where the funnel is clogged or never opened, or the grains still move at
    max_time_s."""
    rig = Rig(spec.geometry)
    rng = np.random.default_rng(spec.seed)
    sim = setup.build_simulation(spec, rig.walls())
    source, flow = Source(spec, rig, rng), []  # type: Any, list[list[float]]
    spilled, closed, ended = 0, rig.opened, ""
    slopes, calm = phases.Slopes(spec), spec.numerics.rest_energy_ratio
    resumed = context.resume()
    if resumed:
        arrays, meta = resumed
        sim.restore(arrays)
        rng.bit_generator.state = meta["rng"]
        source.made, spilled, closed = meta["made"], meta["spilled"], meta["closed"]
        flow, slopes = meta["flow"], phases.Slopes(spec, meta["slopes"])
    chunk = max(round(source.interval / sim.time_step), 1)
    expected = spec.particles.count / spec.geometry.generation_rate_per_s + 0.7

    def read():
        if _holds_back(spec, sim, rig):
            raise MeasureError("the funnel still holds grains")
        return slopes_of(standing(sim, rig.plate_radius, rig.plate_rim))

    while sim.time < spec.numerics.max_time_s:
        if not source.exhausted:
            source.make_layer(sim)
        sim.advance(chunk)
        spilled += take_lost(sim, rig.lost_height)
        flow.append([sim.time, source.made, grains_above(sim, rig.orifice_height)])
        if source.exhausted and closed and phases.motion(sim) < calm:
            setup.take_away(sim, "gate")
            closed = False
        elif source.exhausted and not closed:
            ended = slopes.ended(sim, read, calm)
            if ended:
                break
        told = f"{sim.time:.2f} s, {sim.grain_count} grains"
        context.progress(min(sim.time / expected, 0.99), told)
        context.frame(sim)
        context.checkpoint(
            lambda lost=spilled, shut=closed, seen=slopes.seen: (  # type: ignore[misc]
                sim.state_dict(),
                {"rng": rng.bit_generator.state, "made": source.made, "spilled": lost}
                | {"closed": shut, "flow": flow, "slopes": seen},
            )
        )
    unmade = len(source.radii) - source.made
    if unmade or (not closed and _holds_back(spec, sim, rig)):
        stuck = grains_above(sim, rig.orifice_height)
        missing = f" and {unmade} could not be made" if unmade else ""
        raise RefusedStateError(
            "clogged",
            f"the funnel is clogged: after {sim.time:.1f} s {stuck} of {spec.particles.count} "
            f"grains stand in it{missing}; widen geometry.orifice_diameter_mm, make the grains "
            "smaller, or give numerics.max_time_s more",
        )
    if not ended:
        phase = "filling the closed funnel" if closed else "pouring"
        phases.refuse(phase, sim.time, phases.motion(sim), math.nan, calm)
    return sim, rig, spilled, flow, ended


def _holds_back(spec, sim, rig):
    """Return whether more grains than MOST_LEFT are in the funnel."""
    return grains_above(sim, rig.left_height) > MOST_LEFT * spec.particles.count


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Pour the heap described by `spec` and measure it; returns the metrics of `EXPERIMENT`.

    Raises RefusedStateError where the funnel is clogged or never opened or the plate is not
    covered, MeasureError where no heap stands."""
    sim, rig, spilled, flow, ended = pour(spec, context)
    context.finish(sim, ended)
    left = grains_above(sim, rig.left_height)
    metrics, covered = read_at_rest(sim, context, rig.plate_radius, rig.plate_rim)
    if covered < LEAST_COVERAGE:
        raise RefusedStateError(
            "uncovered",
            f"the plate is not covered: grains lie on {covered:.0%} of it, {LEAST_COVERAGE:.0%} at "
            "least are needed; more grains, a smaller geometry.plate_diameter_mm, or a lower "
            "geometry.discharge_height_mm",
        )
    metrics |= {
        "spilled": spilled,
        "in_funnel": left,
        "rest_time_s": sim.time,
        "rest_energy_ratio": phases.motion(sim),
        "share_in_funnel": left / spec.particles.count,
        "plate_coverage": covered,
    }
    return metrics | flow_of(flow)


EXPERIMENT = Experiment(
    name="heap",
    title="Funnel heap",
    geometry=HeapGeometry,
    run=run,
    metrics=(
        Metric("angle_of_repose_deg", "mean slope of the silhouettes' flanks", 0.0, 90.0),
        Metric("angle_of_repose_sd_deg", "its scatter over the flanks", 0.0, target=False),
        Metric("radial_angle_deg", "slope of the surface averaged over the azimuth", 0.0, 90.0),
        Metric("radial_angle_sd_deg", "its scatter over the sectors", 0.0, target=False),
        Metric("height_mm", "highest point above the plate", 0.0),
        Metric("on_plate", "grains in the heap", 0),
        Metric("spilled", "grains that fell past the plate", 0),
        Metric("in_funnel", "grains left in the funnel", 0),
        Metric("rest_time_s", "time until its slopes stood", 0.0),
        Metric("rest_energy_ratio", "energy of motion at the end", 0.0, target=False),
        Metric("share_in_funnel", "grains left in the funnel over all", 0.0, 1.0),
        Metric("plate_coverage", "share of the plate that lies under grains", 0.0, 1.0),
        Metric("hold_up", "most grains in the funnel at once", 0),
        Metric("emptying_time_s", "when the last grain left the funnel", 0.0),
        Metric(
            "discharge_rate_per_s",
            "grains that left it a second, first and last tenth left out",
            0.0,
        ),
    ),
    check=check,
    prepare=lambda spec: Rig(spec.geometry).walls(),  # an unusable mesh is refused here
    advice=advice,
    impact_speed=fall("discharge_height_mm"),  # to the plate
    # at 5 the restitution comes out 2 % low (docs/evidence.md, steps in a contact)
    least_steps=5,
    poured=True,
    resumes=True,
    walls=lambda spec: Rig(spec.geometry).walls(),
    heap_plate=lambda spec: 0.5e-3 * spec.geometry.plate_diameter_mm,
    quantity=Quantity("angle_of_repose", "deg", 0.1, 89.0, "angle of repose", relative=False),
    levers=lever("discharge_height_mm", 1.0, 1e4, "discharge height"),
)
