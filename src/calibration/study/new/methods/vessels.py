"""Bulk density of grains that were poured into a vessel, or tapped in it, and the flow of those
that run out of a silo through an orifice."""

import math
from statistics import fmean

from calibration.study.new.assumed import ASSUMED
from calibration.study.new.grains import Grains, filling
from calibration.study.new.methods import Answer, Entry, LaboratoryTest
from calibration.study.new.methods.declare import fault, refusal, rows_of, said, simulated
from dem.experiments.discharge import LEAST_WALL
from dem.flow import C_BEVERLOO, FREE_FLOW_RATIO, beverloo


def vessel(entry: Entry, grains: Grains) -> tuple[dict, str]:
    """(run spec without taps, where the vessel's width went): the density is that in the
    laboratory's own vessel, of which a narrower one is simulated where it is wide."""
    diameter = grains.size(grains.diameter_mm)
    narrow = max(ASSUMED.vessel_wide, ASSUMED.vessel_least * grains.longest) * diameter
    enlarged = diameter / grains.diameter_mm
    wide = enlarged * entry.value("vessel", max(ASSUMED.litre_mm, narrow / enlarged))
    narrow = min(narrow, wide)
    count = filling(math.pi / 4 * narrow**2 * ASSUMED.vessel_deep * narrow, diameter)
    geometry = {"vessel_diameter_mm": round(wide, 4)}
    if narrow < wide:
        geometry["simulated_diameter_mm"] = round(narrow, 4)
    went = "as given"
    if enlarged > 1.0:
        went = f"{wide:.4g} mm: as many simulated grains wide as yours are in it"
    return {"particles": grains.particles(count, diameter), "geometry": geometry}, went


def doubts_of_packing(entry: Entry, grains: Grains) -> tuple[str, ...]:
    """Questions about beds that pack as few do. Raises CalibrationError for one that no bed of
    these grains can be; grains that stick may lie as loosely as they will."""
    low = 0.0 if grains.sticky else ASSUMED.packs[0]
    usual = (0.0 if grains.sticky else ASSUMED.usually_packs[0], ASSUMED.usually_packs[1])
    density, doubts = grains.density_kg_m3, ()
    for answer in entry.answers["density"]:
        fraction = answer.value / density
        told = fault("bed_of", answer.place, answer.value, density, fraction)
        if not low < fraction < ASSUMED.packs[1]:
            raise refusal("no_bed", told, low, ASSUMED.packs[1], density)
        if not usual[0] <= fraction <= usual[1]:
            doubts += said("odd_bed", told, *ASSUMED.usually_packs)
    return doubts


def filled(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `bulk_density` without taps, or with the laboratory's; where these are too
    many the density is kept as data that no run is compared with."""
    doubts = doubts_of_packing(entry, grains)
    run, went = vessel(entry, grains)
    taps, places = int(entry.value("taps", 0)), {"vessel": went}
    run["geometry"] |= {"taps": min(taps, ASSUMED.most_taps)}
    run["geometry"] |= {"tap_height_mm": entry.value("height", 3.0)} if taps else {}
    rows, more = rows_of(entry, "density", "bulk_density"), {}
    if taps > ASSUMED.most_taps:
        rows, more = [row | {"role": "hold out"} for row in rows], {"metrics": ()}
        lost = f"kept, and no target: {taps} taps are not simulated, {ASSUMED.most_taps} are"
        places |= {"density": lost, "taps": f"not the rig's, which has {ASSUMED.most_taps}"}
        doubts += (f"{lost}. Measure it after {ASSUMED.most_taps} taps as well",)
    elif not entry.values("vessel"):  # the density may be off by what a wall takes
        wide = run["geometry"]["vessel_diameter_mm"]
        share = ASSUMED.wall_share * grains.size(grains.diameter_mm) / wide
        error = float(f"{0.5 * share * fmean(entry.values('density')):.2g}")
        more = {"discrepancy": {entry.method.readings[0].unit: error}}
        doubts += said("vessel", wide, share, error)
    return simulated(
        entry, "density", "tapped" if taps else "vessel", "bulk_density", run, rows,
        went=places, said=doubts, **more,
    )  # fmt: skip


def ran_out(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `discharge` through the laboratory's own orifice; a time of a mass counts as
    its mean flow."""
    orifice = entry.value("orifice")
    diameter = grains.size(grains.diameter_mm)
    length = grains.longest * diameter
    if orifice < FREE_FLOW_RATIO * length:
        place = entry.place("orifice")
        raise refusal("arching_orifice", place, orifice, length, FREE_FLOW_RATIO)
    least = LEAST_WALL * orifice
    own = entry.value("silo", least)
    if own < least:
        raise refusal("narrow_silo", entry.place("silo"), own, LEAST_WALL, least)
    bed = math.pi / 4 * least**2 * ASSUMED.silo_deep * orifice
    count = filling(bed, diameter, ASSUMED.silo_solid)
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


def _doubts(entry, grains, flow):
    """A question about a flow [g/s] that is far from Beverloo's. Raises CalibrationError for one
    that no grains have."""
    orifice = entry.value("orifice")
    bulk = ASSUMED.silo_solid * grains.density_kg_m3
    usual = 1e3 * C_BEVERLOO * beverloo(bulk, 1e-3 * orifice, 1e-3 * grains.diameter_mm)
    key = next(k for k in ("flow", "time") if entry.values(k))
    told = fault("flow_of", entry.place(key), flow, orifice, usual)
    low, high = (share * usual for share in ASSUMED.passes)
    if not low <= flow <= high:
        raise refusal("no_flow", told, low, high)
    if ASSUMED.usually_passes[0] * usual <= flow <= ASSUMED.usually_passes[1] * usual:
        return ()
    return said("odd_flow", told)
