"""A heap poured through a funnel onto a plate: its angle of repose."""

from dataclasses import replace
from typing import TYPE_CHECKING

from calibration.errors import CalibrationError
from calibration.study.new.grains import Grains
from calibration.study.new.methods.declare import (
    ANGLES,
    Entry,
    LaboratoryTest,
    Method,
    Question,
    doubts_of_angle,
    rows_of,
    simulated,
    wall_question,
)
from dem.experiments.heap import MIN_ORIFICE_RATIO

if TYPE_CHECKING:  # the options are made from this file, and most commands need no more of it
    from calibration.study.new.heap import Heap

NARROW = 5.0  # simulated grains across the orifice, below which it may clog
ENOUGH = 1000  # grains of a heap; 600 of sand scattered by 2.3 deg, 2,500 by 0.9


def heap_of(entry: Entry, grains: Grains) -> "Heap":
    """`Heap` of the answers. Raises CalibrationError for a rig in which no heap can be poured."""
    from calibration.study.new.heap import Heap

    angles = entry.values("measured")
    heap = Heap(
        diameter_mm=grains.diameter_mm,
        density_kg_m3=grains.density_kg_m3,
        orifice_diameter_mm=entry.value("orifice"),
        plate_diameter_mm=entry.value("plate"),
        discharge_height_mm=entry.value("height"),
        angle_deg=sum(angles) / len(angles),
        shear_modulus_Pa=grains.shear_modulus_Pa,
        mass_flow_g_s=entry.value("rate"),
        plate_rim_height_mm=entry.value("rim", 0.0),
        least_restitution=grains.least_restitution,
    )
    _check(entry, heap, grains)
    return heap


def _check(entry, heap, grains):
    """Refuse a rig that no grain passes, or that a heap of the measured angle would touch."""
    length = grains.longest * grains.diameter_mm
    across = heap.orifice_diameter_mm / length
    if across < NARROW:
        clogs = "any funnel clogs" if across < MIN_ORIFICE_RATIO else "most runs would clog"
        raise CalibrationError(
            f"{entry.place('orifice')}: {heap.orifice_diameter_mm:g} mm is {across:.1f} of the "
            f"longest grain ({length:.3g} mm): {clogs}; allowed: {NARROW * length:.3g} mm or more, "
            "or a lifted cylinder in its place"
        )
    if heap.plate_diameter_mm <= heap.orifice_diameter_mm:
        raise CalibrationError(
            f"{entry.place('plate')}: {heap.plate_diameter_mm:g} mm is no wider than the orifice; "
            f"allowed: more than {heap.orifice_diameter_mm:g} mm"
        )
    if heap.discharge_height_mm <= heap.apex_mm:
        raise CalibrationError(
            f"{entry.place('height')}: a heap of {heap.angle_deg:.1f}° on the plate stands "
            f"{heap.apex_mm:.3g} mm high and would reach the orifice at "
            f"{heap.discharge_height_mm:g} mm; allowed: more than that"
        )
    if heap.mass_flow_g_s is not None and heap.feed_share >= 1.0:
        raise CalibrationError(
            f"{entry.place('rate')}: the orifice passes about "
            f"{heap.mass_flow_g_s / heap.feed_share:.3g} g/s (Beverloo 1961); allowed: less"
        )


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `heap` in the laboratory's own funnel."""
    heap = heap_of(entry, grains)
    longest = heap.orifice_diameter_mm / (NARROW * grains.longest)
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
            "max_time_s": round(max(12.0, 2 * poured.pouring_s + 5), 1),
            "rayleigh_fraction": poured.rayleigh_fraction,
        },
    }
    went = {"rate": f"grains made: {poured.feed_per_s:.0f} a second, the same mass"}
    return simulated(
        entry, "measured", "heap", "heap", run, rows_of(entry, "measured", "heap"), went=went,
        said=(*doubts_of_angle(entry, "measured", grains),
              *_said(entry, poured, grains, diameter, heap.count)),
    )  # fmt: skip


def _said(entry, heap, grains, diameter, own):
    """Sentences on a heap; own: grains that the laboratory's own heap has."""
    from calibration.study.config.schema import COARSER
    from calibration.study.new.heap import roomy_height

    fed = "as given" if entry.values("rate") else "assumed"
    covers = (
        f"{heap.count:,} grains cover the plate; the funnel is fed {heap.feed_share:.0%} of what "
        f"its orifice passes (Beverloo 1961; {fed})"
    )
    larger = grains.enlarged(diameter)
    across = heap.orifice_diameter_mm / (grains.longest * diameter * COARSER["quick"] ** (1 / 3))
    narrow = (
        f"the quick profile's larger grains may clog the orifice ({across:.1f} of them across)"
        if across < NARROW
        else ""
    )
    roomy = roomy_height(heap.plate_diameter_mm, heap.plate_rim_height_mm, heap.angle_deg)
    low = (
        f"warning: heaps little steeper than yours touch the orifice and are cut off; at {roomy} "
        "mm (--height) they would not be"
        if heap.discharge_height_mm < roomy
        else ""
    )
    quick = COARSER["quick"]
    few = (
        f"warning: the quick profile pours {heap.count / quick:.0f} grains, whose heaps scatter by "
        f"degrees; --grains {quick * ENOUGH:.0f} gives it {ENOUGH}"
        if heap.count < quick * ENOUGH <= own
        else ""
    )
    larger = f"its grains are {larger}" if larger else ""
    return tuple(s for s in (covers, larger, narrow, low, few) if s)


METHODS = (Method(
    name="funnel",
    title="Funnel heap",
    about="Grains run through a funnel onto a plate, and the angle of the heap is read.",
    questions=(
        Question("measured", "measured angles of repose, each reading; in an option also the table "
                 "or photographs that hold them", "angle_of_repose_deg", reading=True,
                 needed=True, most=89.0, option="measured", example="26.1", headings=ANGLES),
        Question("orifice", "diameter of the funnel's orifice", "orifice_diameter_mm",
                 needed=True, option="orifice", example="25 mm"),
        Question("plate", "diameter of the base plate", "plate_diameter_mm", needed=True,
                 option="plate", example="100 mm"),
        Question("height", "orifice above the plate; where pouring ended as the heap "
                 "touched the funnel (a fixed funnel), a little above the heap",
                 "discharge_height_mm", needed=True, option="height", example="75 mm"),
        Question("rim", "height of the plate's rim, where it has one", "plate_rim_height_mm",
                 option="rim", example=""),
        Question("rate", "mass poured in a second, where it was measured", "mass_flow_g_s",
                 option="rate", example=""),
        wall_question("what the plate is of", "plate-of"),
    ),
    rank=10,
    becomes=becomes,
    spread=True,
    own_options=True,
    leads=True,
),)  # fmt: skip
