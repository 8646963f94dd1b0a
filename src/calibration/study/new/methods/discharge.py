"""Grains that run out of a silo through an orifice."""

import math

from calibration.study.new.grains import Grains, filling
from calibration.study.new.methods.declare import (
    Answer,
    Entry,
    LaboratoryTest,
    fault,
    refusal,
    rows_of,
    said,
    simulated,
)
from dem.experiments.discharge import LEAST_WALL
from dem.flow import C_BEVERLOO, FREE_FLOW_RATIO, beverloo

SOLID = 0.55  # solid fraction of the bed
DEEP = 2.4  # bed over orifice; at 2 the flow begins to go with the depth


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `discharge` through the laboratory's own orifice; a time of a mass counts as
    its mean flow."""
    orifice = entry.value("orifice")
    diameter = _size(entry, grains, orifice)
    least = LEAST_WALL * orifice
    own = entry.value("silo", least)
    if own < least:
        raise refusal("narrow_silo", entry.place("silo"), own, LEAST_WALL, least)
    count = filling(math.pi / 4 * least**2 * DEEP * orifice, diameter, SOLID)
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


PASSES, USUAL = (0.1, 2.0), (0.5, 1.4)
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
    if USUAL[0] * usual <= flow <= USUAL[1] * usual:
        return ()
    return said("odd_flow", told)
