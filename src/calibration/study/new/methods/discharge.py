"""Grains that run out of a silo through an orifice."""

import math

from calibration.errors import CalibrationError
from calibration.study.new.grains import Grains, filling
from calibration.study.new.methods.declare import (
    Answer,
    Entry,
    LaboratoryTest,
    Method,
    Question,
    rows_of,
    said,
    simulated,
    wall_question,
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
        raise CalibrationError(
            f"{entry.place('silo')}: {own:g} mm is less than {LEAST_WALL:g} orifices, so that its "
            f"wall sets the flow; allowed: {least:g} mm or more"
        )
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
        raise CalibrationError(
            f"{entry.place('orifice')}: {orifice:g} mm is {orifice / length:.1f} of the longest "
            f"simulated grain ({length:.3g} mm): arches stop the flow; allowed: "
            f"{FREE_FLOW_RATIO * length:.3g} mm or more. A wider orifice in the laboratory helps"
        )
    return diameter


def _rows(entry, orifice):
    """(rows, mean flow [g/s]) of flows, or of the time of a mass."""
    if bool(entry.values("flow")) == bool(entry.values("time")):
        raise CalibrationError(
            f"{entry.place('orifice')}: a discharge needs its flow, or its time and mass; allowed: "
            "one of the two"
        )
    if not entry.values("flow"):
        mass = entry.value("mass")
        if mass is None:
            raise CalibrationError(f"{entry.place('time')}: needs the mass that ran out (mass)")
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
    told = (
        f"{entry.place(key)}: a flow of {flow:.4g} g/s, where an orifice of {orifice:g} mm passes "
        f"about {usual:.3g} g/s of your grains (Beverloo 1961)"
    )
    low, high = (share * usual for share in PASSES)
    if not low <= flow <= high:
        raise CalibrationError(f"{told}; allowed: {low:.3g} to {high:.3g} g/s")
    if USUAL[0] * usual <= flow <= USUAL[1] * usual:
        return ()
    return (f"{told}: are orifice, mass and time right?",)


METHODS = (Method(
    name="discharge",
    title="Discharge through an orifice",
    about="A silo or hopper runs empty, and the mass over time is read.",
    questions=(
        Question("flow", "mass in a second, each reading", "mass_flow_g_s", reading=True,
                 example="180 g/s", headings=("massenstrom", "débit massique", "débit")),
        Question("time", "or the time in which a mass ran out", "emptying_time_s", reading=True,
                 example=""),
        Question("mass", "the mass that ran out in that time", "mass_kg", example=""),
        Question("orifice", "diameter of the orifice", "orifice_diameter_mm", needed=True,
                 example="35 mm"),
        Question("silo", "inner diameter of the silo", "inner_diameter_mm", example="150 mm"),
        Question("half_angle", "hopper's wall from the vertical; 90 is a flat bottom",
                 "hopper_half_angle_deg", most=90.0, example="90"),
        wall_question("what the silo is of"),
    ),
    rank=30,
    becomes=becomes,
    leads=True,
),)  # fmt: skip
