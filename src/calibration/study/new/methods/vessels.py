"""Bulk density of grains that were poured into a vessel, or tapped in it, and the flow of those
that run out of a silo through an orifice."""

import math
from collections.abc import Mapping
from statistics import fmean
from typing import Any

from calibration.study.new.grains import Grains, filling
from calibration.study.new.methods import Answer, Entry, LaboratoryTest
from calibration.study.new.methods.declare import fault, refusal, rows_of, said, simulated
from dem.experiments.discharge import LEAST_WALL
from dem.flow import C_BEVERLOO, FREE_FLOW_RATIO, beverloo

WIDE = 15.0  # grains across the simulated vessel
LEAST = 7.0  # of the longest grain
DEEP = 0.9  # of the vessel's width is filled
LITRE_MM = 108.4  # width of a litre as wide as high: the vessel where none was told
MOST_TAPS = 100  # of a run; each is a quarter of a second of simulated time
WALL = 0.7  # by which the density is less for its walls, in grains over the vessel's width


def vessel(entry: Entry, grains: Grains) -> tuple[dict, str]:
    """(run spec without taps, where the vessel's width went): the density is that in the
    laboratory's own vessel, of which a narrower one is simulated where it is wide."""
    diameter = grains.size(grains.diameter_mm)
    narrow = max(WIDE, LEAST * grains.longest) * diameter
    enlarged = diameter / grains.diameter_mm
    wide = enlarged * entry.value("vessel", max(LITRE_MM, narrow / enlarged))
    narrow = min(narrow, wide)
    count = filling(math.pi / 4 * narrow**2 * DEEP * narrow, diameter)
    geometry = {"vessel_diameter_mm": round(wide, 4)}
    if narrow < wide:
        geometry["simulated_diameter_mm"] = round(narrow, 4)
    went = "as given"
    if enlarged > 1.0:
        went = f"{wide:.4g} mm: as many simulated grains wide as yours are in it"
    return {"particles": grains.particles(count, diameter), "geometry": geometry}, went


def assumed(
    entry: Entry, grains: Grains, run: Mapping[str, Any]
) -> tuple[dict[str, float], tuple[str, ...]]:
    """({metric: standard deviation by which the density may be off}, sentences) of a vessel that
    was not told; nothing of one that was."""
    if entry.values("vessel"):
        return {}, ()
    metric = entry.method.readings[0].unit
    wide = run["geometry"]["vessel_diameter_mm"]
    share = WALL * grains.size(grains.diameter_mm) / wide
    error = float(f"{0.5 * share * fmean(entry.values('density')):.2g}")
    return {metric: error}, said("vessel", wide, share, error)


PACKS, USUAL = (0.3, 0.9), (0.45, 0.75)
"""Solid fractions between which a bed of dry grains lies, and most do: spheres pour to 0.55 to
0.6. Choices of this project."""


def doubts_of_packing(entry: Entry, grains: Grains) -> tuple[str, ...]:
    """Questions about beds that pack as few do. Raises CalibrationError for one that no bed of
    these grains can be; grains that stick may lie as loosely as they will."""
    low = 0.0 if grains.sticky else PACKS[0]
    usual = (0.0 if grains.sticky else USUAL[0], USUAL[1])
    density, doubts = grains.density_kg_m3, ()
    for answer in entry.answers["density"]:
        fraction = answer.value / density
        told = fault("bed_of", answer.place, answer.value, density, fraction)
        if not low < fraction < PACKS[1]:
            raise refusal("no_bed", told, low, PACKS[1], density)
        if not usual[0] <= fraction <= usual[1]:
            doubts += said("odd_bed", told, *USUAL)
    return doubts


def filled(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `bulk_density` without taps, or with the laboratory's; more than MOST_TAPS are
    kept as data that no run is compared with."""
    doubts = doubts_of_packing(entry, grains)
    run, went = vessel(entry, grains)
    taps, places = int(entry.value("taps", 0)), {"vessel": went}
    run["geometry"] |= {"taps": min(taps, MOST_TAPS)}
    run["geometry"] |= {"tap_height_mm": entry.value("height", 3.0)} if taps else {}
    rows = rows_of(entry, "density", "bulk_density")
    if taps <= MOST_TAPS:
        discrepancy, said = assumed(entry, grains, run)
        more: dict[str, Any] = {"discrepancy": discrepancy}
    else:
        rows, more = [row | {"role": "hold out"} for row in rows], {"metrics": ()}
        lost = f"kept, and no target: {taps} taps are not simulated, {MOST_TAPS} are"
        places |= {"density": lost, "taps": f"not the rig's, which has {MOST_TAPS}"}
        said = (f"{lost}. Measure it after {MOST_TAPS} taps as well",)
    return simulated(
        entry, "density", "tapped" if taps else "vessel", "bulk_density", run, rows,
        went=places, said=doubts + said, **more,
    )  # fmt: skip


SOLID = 0.55  # solid fraction of the bed
DEEP_BED = 2.4  # bed over orifice; at 2 the flow begins to go with the depth


def ran_out(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `discharge` through the laboratory's own orifice; a time of a mass counts as
    its mean flow."""
    orifice = entry.value("orifice")
    diameter = _size(entry, grains, orifice)
    least = LEAST_WALL * orifice
    own = entry.value("silo", least)
    if own < least:
        raise refusal("narrow_silo", entry.place("silo"), own, LEAST_WALL, least)
    count = filling(math.pi / 4 * least**2 * DEEP_BED * orifice, diameter, SOLID)
    geometry = {"orifice_diameter_mm": orifice, "silo_diameter_mm": round(least, 4)}
    if entry.values("half_angle"):
        geometry["hopper_half_angle_deg"] = entry.value("half_angle")
    rows, flow = _rows(entry, orifice)
    doubts = _doubts(entry, grains, flow)
    went = dict.fromkeys(("flow", "time"), "a target, as mass flow") | {
        "mass": "over the time: the mass flow. The rig's own mass is smaller",
        "silo": f"not the rig's: it is {least:.3g} mm, {LEAST_WALL:g} orifices wide",
    }
    lasts = count * grains.density_kg_m3 * 1e-6 * math.pi / 6 * diameter**3 / flow
    narrow = LEAST_WALL if entry.value("silo", math.inf) > least else None
    return simulated(
        entry, "flow", "silo", "discharge",
        {"particles": grains.particles(count, diameter), "geometry": geometry,
         "numerics": {"max_time_s": round(max(10.0, 3.0 * lasts), 1)}},
        rows, went=went, said=doubts + said("silo", narrow, grains.enlarged(diameter)),
    )  # fmt: skip


def _size(entry, grains, orifice):
    diameter = grains.size(grains.diameter_mm)
    length = grains.longest * diameter
    if orifice < FREE_FLOW_RATIO * length:
        place = entry.place("orifice")
        raise refusal("arching_orifice", place, orifice, length, FREE_FLOW_RATIO)
    return diameter


def _rows(entry, orifice):
    """(rows, mean flow [g/s]) of flows, or of the time of a mass."""
    if bool(entry.values("flow")) == bool(entry.values("time")):
        raise refusal("flow_or_time", entry.place("orifice"))
    if not entry.values("flow"):
        mass = entry.value("mass")
        if mass is None:
            raise refusal("no_mass", entry.place("time"))
        flows = [Answer(a.text, 1e3 * mass / a.value, a.place) for a in entry.answers["time"]]
        answers = dict(entry.answers) | {"flow": flows}
        if entry.values("sd"):
            share = entry.value("sd") / entry.value("time")
            answers["sd"] = [Answer("", share * flows[0].value, entry.place("sd"))]
        entry = Entry(entry.method, answers)
    rows = rows_of(entry, "flow", "discharge", orifice_diameter_mm=orifice)
    flows = entry.values("flow")
    return rows, sum(flows) / len(flows)


PASSES, USUAL_FLOW = (0.1, 2.0), (0.5, 1.4)
"""Flows over Beverloo's between which measured ones lie, and most do: air slows fine grains down,
and a steep hopper lets more pass than a flat bottom. Choices of this project."""


def _doubts(entry, grains, flow):
    """A question about a flow [g/s] that is far from Beverloo's. Raises CalibrationError for one
    that no grains have."""
    orifice = entry.value("orifice")
    bulk = SOLID * grains.density_kg_m3
    usual = 1e3 * C_BEVERLOO * beverloo(bulk, 1e-3 * orifice, 1e-3 * grains.diameter_mm)
    key = next(k for k in ("flow", "time") if entry.values(k))
    told = fault("flow_of", entry.place(key), flow, orifice, usual)
    low, high = (share * usual for share in PASSES)
    if not low <= flow <= high:
        raise refusal("no_flow", told, low, high)
    if USUAL_FLOW[0] * usual <= flow <= USUAL_FLOW[1] * usual:
        return ()
    return said("odd_flow", told)
