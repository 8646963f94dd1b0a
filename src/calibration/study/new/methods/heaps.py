"""Heaps whose angle of repose is read: poured through a funnel onto a plate, or left by an open
cylinder that is lifted. How many grains a rig takes, how fast its funnel feeds them, and what that
costs to compute."""

import math
from dataclasses import dataclass, replace
from statistics import fmean

from calibration.study.config.schema import COARSER
from calibration.study.new.assumed import ASSUMED
from calibration.study.new.grains import Grains, filling, short, volume_mm3
from calibration.study.new.methods import Entry, LaboratoryTest
from calibration.study.new.methods.declare import fault, refusal, rows_of, said, simulated
from dem.advice import bed_pressure, pressed_step
from dem.constants import GRAVITY
from dem.contact.registry import ContactParameters, Laws, Material
from dem.experiments.heap import MIN_ORIFICE_RATIO, PACKING, solid_rate
from dem.flow import FREE_FLOW_RATIO, K_BEVERLOO
from dem.timescales import hertz_contact_time, rayleigh_time

QUICK_WIDER = COARSER["quick"] ** (1 / 3)  # grains of the quick profile, times as wide
STEEL = Material(7800.0, 8.0e10, 0.3)


def cone_height(plate_mm: float, angle_deg: float) -> float:
    """Height [mm] of a cone of the angle over the whole plate."""
    return 0.5 * plate_mm * math.tan(math.radians(angle_deg))


def steady_fraction(
    most: float, radius: float, material: Material, pressure: float, restitution: float,
    longest: float = math.inf,
) -> float:  # fmt: skip
    """Rayleigh times in a time step, `most` or fewer, at which grains under a pressure [Pa] come to
    rest; longest: a step [s] that it may have as well. radius: of the smallest grain [m]."""
    contact = ContactParameters(restitution, 0.0)
    step = min(pressed_step(radius, material, contact, pressure, Laws()), longest)
    m = material
    rayleigh = rayleigh_time(radius, m.density, m.shear_modulus, m.poisson_ratio)
    return min(most, math.floor(100 * step / rayleigh) / 100)


@dataclass(frozen=True)
class Heap:
    """A funnel pour; lengths [mm], density of the grain [kg/m3], modulus [Pa], angle [deg]."""

    diameter_mm: float
    density_kg_m3: float
    orifice_diameter_mm: float
    plate_diameter_mm: float
    discharge_height_mm: float
    angle_deg: float
    shear_modulus_Pa: float
    mass_flow_g_s: float | None = None  # poured in a second, where the laboratory measured it
    plate_rim_height_mm: float = 0.0
    least_restitution: float = 0.2  # between grains, of those that are tried

    @property
    def apex_mm(self) -> float:
        """Height [mm] above the plate of a full cone of the measured angle, which stands on the
        rim."""
        return self.plate_rim_height_mm + cone_height(self.plate_diameter_mm, self.angle_deg)

    @property
    def count(self) -> int:
        """Grains that a cone of the measured angle over the whole plate takes, with the bed inside
        the rim, and what rolls off."""
        area = math.pi / 4 * self.plate_diameter_mm**2
        cone = area * cone_height(self.plate_diameter_mm, self.angle_deg) / 3
        grain = math.pi / 6 * self.diameter_mm**3
        heap = cone + area * self.plate_rim_height_mm
        return max(round(ASSUMED.spill * PACKING * heap / grain), ASSUMED.fewest_grains)

    @property
    def capacity_per_s(self) -> float:
        """Grains that the orifice passes in a second (Beverloo 1961)."""
        return self._passes(1e-3 * self.diameter_mm) / self._grain

    @property
    def _grain(self):
        """Volume [m3] of a grain."""
        return math.pi / 6 * (1e-3 * self.diameter_mm) ** 3

    def _passes(self, d):
        """Solid volume [m3/s] of grains of `d` [m] that the orifice passes."""
        opening = max(1e-3 * self.orifice_diameter_mm, (K_BEVERLOO + 0.1) * d)
        return solid_rate(opening, d)

    @property
    def feed_per_s(self) -> float:
        """Grains made in a second: as was measured, else `feed` of what the orifice passes of the
        quick profile's grains, so that the same mass in a second passes in that profile too."""
        if self.mass_flow_g_s is None:
            own = 1e-3 * self.diameter_mm
            passes = min(self._passes(own), self._passes(own * QUICK_WIDER))
            return ASSUMED.feed * passes / self._grain
        return self.mass_flow_g_s / (1e3 * self.density_kg_m3 * self._grain)

    @property
    def feed_share(self) -> float:
        """The feed over what the orifice passes."""
        return self.feed_per_s / self.capacity_per_s

    @property
    def rayleigh_fraction(self) -> float:
        """Rayleigh times in a time step: fewer than is usual where an impact on the plate would
        last less than `impact_steps` or pressed grains would tremble."""
        radius = 0.5e-3 * self.diameter_mm
        material = Material(self.density_kg_m3, self.shear_modulus_Pa, 0.25)
        speed = math.sqrt(2.0 * GRAVITY * 1e-3 * self.discharge_height_mm)
        impact = hertz_contact_time(radius, speed, material, STEEL) / ASSUMED.impact_steps
        pressure = bed_pressure(self.count, 2.0 * radius, self.density_kg_m3)
        most, least = ASSUMED.rayleigh, self.least_restitution
        return steady_fraction(most, radius, material, pressure, least, impact)

    def of_at_most(self, most: int) -> "Heap":
        """The same heap of fewer, larger grains; an orifice of FREE_FLOW_RATIO grains stays so."""
        if self.count <= most:
            return self
        wanted = self.diameter_mm * (self.count / most) ** (1 / 3)
        passing = max(self.orifice_diameter_mm / FREE_FLOW_RATIO, self.diameter_mm)
        return replace(self, diameter_mm=round(min(wanted, passing), 4))


def doubts_of_angle(entry: Entry, key: str, grains: Grains) -> tuple[str, ...]:
    """Questions about angles of repose that few grains have. Raises CalibrationError for one that
    no friction allows; grains that stick stand as steeply as they will."""
    doubts: list[str] = []
    for answer in entry.answers[key]:
        friction = math.tan(math.radians(answer.value))
        told = fault("heap_of", answer.place, answer.value, friction)
        if answer.value < ASSUMED.flattest_heap_deg:
            raise refusal("slippery", told, ASSUMED.flattest_heap_deg)
        if answer.value > ASSUMED.steepest_deg and not grains.sticky:
            raise refusal("too_steep", told, ASSUMED.steepest_deg)
        if answer.value > ASSUMED.steep_deg and not grains.sticky:
            doubts += said("steep", told, ASSUMED.steep_deg)
    return tuple(doubts)


def heap_of(entry: Entry, grains: Grains) -> Heap:
    """`Heap` of the answers. Raises CalibrationError for a rig that no grain passes, or that a heap
    of the measured angle would touch."""
    heap = Heap(
        diameter_mm=grains.diameter_mm,
        density_kg_m3=grains.density_kg_m3,
        orifice_diameter_mm=entry.value("orifice"),
        plate_diameter_mm=entry.value("plate"),
        discharge_height_mm=entry.value("height"),
        angle_deg=fmean(entry.values("measured")),
        shear_modulus_Pa=grains.shear_modulus_Pa,
        mass_flow_g_s=entry.value("rate"),
        plate_rim_height_mm=entry.value("rim", 0.0),
        least_restitution=grains.least_restitution,
    )
    length = grains.longest * grains.diameter_mm
    orifice, plate = heap.orifice_diameter_mm, heap.plate_diameter_mm
    if orifice < ASSUMED.narrow_orifice * length:
        clogs = orifice < MIN_ORIFICE_RATIO * length
        place, least = entry.place("orifice"), ASSUMED.narrow_orifice
        raise refusal("narrow_orifice", place, orifice, length, least, clogs)
    if plate <= orifice:
        raise refusal("narrow_plate", entry.place("plate"), plate, orifice)
    if heap.discharge_height_mm <= heap.apex_mm:
        raise refusal("low_orifice", entry.place("height"), heap)
    if heap.mass_flow_g_s is not None and heap.feed_share >= 1.0:
        raise refusal("fast_pour", entry.place("rate"), heap.mass_flow_g_s / heap.feed_share)
    return heap


def funnel(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `heap` in the laboratory's own funnel."""
    heap = heap_of(entry, grains)
    longest = heap.orifice_diameter_mm / (ASSUMED.narrow_orifice * grains.longest)
    poured = heap.of_at_most(grains.most)
    diameter = grains.size(min(poured.diameter_mm, longest))
    poured = replace(heap, diameter_mm=round(diameter, 4))
    mouth = max(heap.plate_diameter_mm, 2 * heap.orifice_diameter_mm)
    geometry = {
        "orifice_diameter_mm": heap.orifice_diameter_mm,
        "plate_diameter_mm": heap.plate_diameter_mm,
        "discharge_height_mm": heap.discharge_height_mm,
        "funnel_top_diameter_mm": mouth,
        "generation_rate_per_s": round(poured.feed_per_s),
    }
    if heap.plate_rim_height_mm:
        geometry["plate_rim_height_mm"] = heap.plate_rim_height_mm
    run = {
        "particles": grains.particles(poured.count, diameter),
        "geometry": geometry,
        "numerics": {
            "max_time_s": round(max(12.0, 2 * (poured.count / poured.feed_per_s) + 5), 1),
            "rayleigh_fraction": poured.rayleigh_fraction,
        },
    }
    went = {"rate": f"grains made: {poured.feed_per_s:.0f} a second, the same mass"}
    return simulated(
        entry, "measured", "heap", "heap", run, rows_of(entry, "measured", "heap"), went=went,
        said=(*doubts_of_angle(entry, "measured", grains),
              *_said_of_funnel(entry, poured, grains, diameter, heap.count)),
    )  # fmt: skip


def _said_of_funnel(entry, heap, grains, diameter, own):
    """Sentences on a heap; own: grains that the laboratory's own heap has."""
    fed = "as given" if entry.values("rate") else "assumed"
    across = heap.orifice_diameter_mm / (grains.longest * diameter * QUICK_WIDER)
    steeper = cone_height(heap.plate_diameter_mm, heap.angle_deg + ASSUMED.steeper_deg)
    roomy = math.ceil(heap.plate_rim_height_mm + steeper)
    larger, quick = grains.enlarged(diameter), COARSER["quick"]
    limits = ASSUMED.narrow_orifice, roomy, ASSUMED.enough_grains
    return said("funnel", heap, own, fed, larger, quick, across, *limits)


def cylinder(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `lifted_cylinder`, as wide and as full as was told."""
    if grains.sticky and not entry.values("cylinder"):
        # a heap of grains that stick is the steeper the smaller it is
        raise refusal("unknown_cylinder", entry.place("angle"))
    longest = grains.longest * grains.size(grains.diameter_mm)
    wide = entry.value("cylinder", max(ASSUMED.assumed_across * longest, ASSUMED.usual_cylinder_mm))
    deep = entry.value("depth", ASSUMED.cylinder_deep * wide)
    diameter = _size(entry, grains, wide, deep)
    count = filling(math.pi / 4 * wide**2 * deep, diameter)
    # a plate that a heap at the measured angle does not cover
    slope = math.tan(math.radians(fmean(entry.values("angle"))))
    bulk = count * volume_mm3(diameter) / 0.6
    cone = 2.0 * (3.0 * bulk / (math.pi * slope)) ** (1.0 / 3.0)
    plate = entry.value("plate", math.ceil(max(ASSUMED.plate_room * cone, 2.0 * wide)))
    least = wide + ASSUMED.plate_around * diameter * grains.longest
    if plate < least:
        raise refusal("narrow_base", entry.place("plate"), plate, wide, least)
    run = {
        "particles": grains.particles(count, diameter),
        "geometry": {
            "cylinder_diameter_mm": round(wide, 3),
            "plate_diameter_mm": round(plate, 3),
            "lift_speed_mm_s": entry.value("speed", ASSUMED.lift_speed_mm_s),
        },
        "numerics": {"max_time_s": 5.0},
    }
    rows, assumed = rows_of(entry, "angle", "lifted_cylinder"), not entry.values("cylinder")
    return simulated(
        entry, "angle", "cylinder", "lifted_cylinder", run, rows,
        went={"depth": f"{count:.0f} grains of {diameter:.3g} mm, as deep"},
        discrepancy={"angle_of_repose_deg": ASSUMED.assumed_rig_deg} if assumed else {},
        said=(*doubts_of_angle(entry, "angle", grains),
              *_said_of_cylinder(entry, grains, diameter, wide, deep, count)),
    )  # fmt: skip


def _size(entry, grains, wide, deep):
    """Diameter of the simulated grains [mm]: at most `grains.most` fill the cylinder, and enough
    fit across it. Raises CalibrationError for a cylinder that is too narrow for the laboratory's
    own."""
    limit = wide / (ASSUMED.cylinder_across * grains.longest)
    if grains.size(grains.diameter_mm) > limit:
        length = grains.longest * grains.size(grains.diameter_mm)
        least = ASSUMED.cylinder_across
        told = wide, wide / length, short(length), least, short(least * length)
        raise refusal("narrow_cylinder", entry.place("cylinder"), *told)
    own = filling(math.pi / 4 * wide**2 * deep, grains.diameter_mm)
    wanted = grains.diameter_mm * max(own / grains.most, 1.0) ** (1 / 3)
    # the quick profile's larger grains fit too
    return grains.size(min(wanted, limit / QUICK_WIDER))


def _said_of_cylinder(entry, grains, diameter, wide, deep, count):
    words = {"cylinder": f"{wide:.3g} mm wide", "depth": f"filled {deep:.3g} mm deep",
             "speed": f"lifted at {ASSUMED.lift_speed_mm_s:g} mm/s"}  # fmt: skip
    assumed = {key: text for key, text in words.items() if not entry.values(key)}
    fits = wide >= ASSUMED.cylinder_across * grains.longest * diameter * QUICK_WIDER
    sd, larger = ASSUMED.assumed_rig_deg, grains.enlarged(diameter)
    return said("cylinder", assumed, sd, fits, count, larger)
