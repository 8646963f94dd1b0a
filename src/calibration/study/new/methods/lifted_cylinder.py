"""A heap that an open cylinder leaves when it is lifted: its angle of repose."""

import math

from calibration.errors import CalibrationError
from calibration.study.new.grains import Grains, filling, short, volume_mm3
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

ACROSS = 10.0  # longest grains across a cylinder that is assumed, at least
USUAL_MM = 50.0  # width of one that is assumed, at least: a choice of this project, no source
LEAST = 5.0  # of them across any cylinder
DEEP = 1.5  # depth of the grains over the cylinder's width, assumed
SPEED = 20.0  # mm/s, assumed: slow enough that the grains follow the rim
FASTEST = 2000.0  # mm/s: no hand is faster
ROUND = 4.0  # of the largest grains by which a plate is wider than the cylinder, at least
ROOM = 1.6  # of the plate over the width of a cone of the measured angle
RIG_ASSUMED = 2.0
"""Standard deviation [deg] by which the angle may be off where the cylinder's width is assumed:
the rig moves it by degrees. A choice of this project, no source."""


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `lifted_cylinder`, as wide and as full as was told."""
    _refuse_unknown(entry, grains)
    longest = grains.longest * grains.size(grains.diameter_mm)
    wide = entry.value("cylinder", max(ACROSS * longest, USUAL_MM))
    deep = entry.value("depth", DEEP * wide)
    diameter = _size(entry, grains, wide, deep)
    count = filling(math.pi / 4 * wide**2 * deep, diameter)
    angles = entry.values("angle")
    plate = entry.value("plate", _plate(count * volume_mm3(diameter) / 0.6, angles, wide))
    least = wide + ROUND * diameter * grains.longest
    if plate < least:
        raise CalibrationError(
            f"{entry.place('plate')}: {plate:g} mm is too narrow for the heap of a cylinder of "
            f"{wide:g} mm; allowed: {least:.3g} mm or more"
        )
    run = {
        "particles": grains.particles(count, diameter),
        "geometry": {
            "cylinder_diameter_mm": round(wide, 3),
            "plate_diameter_mm": round(plate, 3),
            "lift_speed_mm_s": entry.value("speed", SPEED),
        },
        "numerics": {"max_time_s": 5.0},
    }
    rows, assumed = rows_of(entry, "angle", "lifted_cylinder"), not entry.values("cylinder")
    return simulated(
        entry, "angle", "cylinder", "lifted_cylinder", run, rows,
        went={"depth": f"{count:.0f} grains of {diameter:.3g} mm, as deep"},
        discrepancy={"angle_of_repose_deg": RIG_ASSUMED} if assumed else {},
        said=(*doubts_of_angle(entry, "angle", grains),
              *_said(entry, grains, diameter, wide, deep, count)),
    )  # fmt: skip


def _refuse_unknown(entry, grains):
    """A heap of grains that stick is the steeper the smaller it is: its rig cannot be assumed."""
    if grains.sticky and not entry.values("cylinder"):
        raise CalibrationError(
            f"{entry.place('angle')}: a powder that sticks heaps the steeper the smaller its heap "
            "is, and the cylinder was not told; allowed: cylinder beside it (inner diameter, such "
            "as 60 mm), and depth"
        )


def _size(entry, grains, wide, deep):
    """Diameter of the simulated grains [mm]: at most `grains.most` fill the cylinder, and LEAST
    fit across it. Raises CalibrationError for a cylinder that is too narrow for the laboratory's
    own."""
    limit = wide / (LEAST * grains.longest)
    if grains.size(grains.diameter_mm) > limit:
        length = grains.longest * grains.size(grains.diameter_mm)
        raise CalibrationError(
            f"{entry.place('cylinder')}: {wide:g} mm is {wide / length:.2g} of the longest "
            f"simulated grain ({short(length)} mm); allowed: {LEAST:g} of them, "
            f"{short(LEAST * length)} mm, or more"
        )
    own = filling(math.pi / 4 * wide**2 * deep, grains.diameter_mm)
    wanted = grains.diameter_mm * max(own / grains.most, 1.0) ** (1 / 3)
    # the quick profile's larger grains fit too
    return grains.size(min(wanted, limit / _coarser()))


def _coarser():
    """How many times as wide the grains of the quick profile are."""
    from calibration.study.config.schema import COARSER  # most commands need no more of this file

    return COARSER["quick"] ** (1 / 3)


def _plate(bulk, angles, wide):
    """Width [mm] of a plate that a heap of `bulk` [mm3] at the measured angle does not cover."""
    slope = math.tan(math.radians(sum(angles) / len(angles)))
    cone = 2.0 * (3.0 * bulk / (math.pi * slope)) ** (1.0 / 3.0)
    return math.ceil(max(ROOM * cone, 2.0 * wide))


def _said(entry, grains, diameter, wide, deep, count):
    found = []
    assumed = [k for k in ("cylinder", "depth", "speed") if not entry.values(k)]
    if assumed:
        words = {"cylinder": f"{wide:.3g} mm wide", "depth": f"filled {deep:.3g} mm deep",
                 "speed": f"lifted at {SPEED:g} mm/s"}  # fmt: skip
        found.append(
            f"assumed of the cylinder, as it was not told: {', '.join(words[k] for k in assumed)}. "
            f"The rig moves the angle by degrees: give {', '.join(f'{k}=' for k in assumed)}"
        )
        if "cylinder" in assumed:
            found.append(
                f"until then the angle counts with ± {RIG_ASSUMED:g}° beside its own error"
            )
    if wide < LEAST * grains.longest * diameter * _coarser():
        found.append(
            "the quick profile's larger grains do not fit the cylinder: use another profile"
        )
    larger = grains.enlarged(diameter)
    return (*found, f"{count:.0f} grains fill the cylinder" + (f", of {larger}" if larger else ""))


METHODS = (Method(
    name="lifted-cylinder",
    title="Lifted cylinder",
    about="An open cylinder on a plate is filled and lifted, and the angle of the heap is read.",
    questions=(
        Question("angle", "angle of repose, each reading", "angle_of_repose_deg", reading=True,
                 needed=True, most=89.0, example="26.1", headings=ANGLES),
        Question("cylinder", "inner diameter of the cylinder", "inner_diameter_mm",
                 example="60 mm"),
        Question("depth", "depth of the grains in it before the lift", "depth_mm",
                 example="90 mm"),
        Question("speed", "speed of the lift", "lift_speed_mm_s", most=FASTEST,
                 example="20 mm/s"),
        Question("plate", "diameter of the base plate", "plate_diameter_mm", example=""),
        wall_question("what cylinder and plate are of"),
    ),
    rank=11,
    becomes=becomes,
    spread=True,
    leads=True,
),)  # fmt: skip
