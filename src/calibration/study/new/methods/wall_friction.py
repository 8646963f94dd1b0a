"""Friction of a bed on a plate under a load (Jenike)."""

from calibration.errors import CalibrationError
from calibration.study.new.grains import Grains
from calibration.study.new.methods.declare import (
    NORMAL_STRESS,
    Entry,
    LaboratoryTest,
    Method,
    Question,
    about_a_line,
    rows_of,
    simulated,
    wall_question,
)

ACROSS, COUNT = 12.0, 800
"""Longest grains across the ring, and the grains in it: the experiment's own."""

EXPERIMENT = "wall_friction"


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `wall_friction` under the entry's load."""
    if bool(entry.values("stress")) == bool(entry.values("angle")):
        raise CalibrationError(
            f"{entry.place('load')}: wall friction needs the shear stress or its angle; allowed: "
            "one of the two"
        )
    load = entry.value("load")
    diameter = grains.size(grains.diameter_mm)
    length = grains.longest * diameter
    geometry = {
        "normal_stress_kPa": load,
        "ring_diameter_mm": round(ACROSS * length, 4),
        "slide_speed_mm_s": round(10.0 * length, 4),
        "slide_mm": round(2.0 * length, 4),
    }
    key = "stress" if entry.values("stress") else "angle"
    return simulated(
        entry, key, f"wall_{load:g}_kPa".replace(".", "_"), EXPERIMENT,
        {"particles": grains.particles(COUNT * grains.longest**2, diameter), "geometry": geometry},
        rows_of(entry, key, EXPERIMENT, normal_stress_kPa=load),
    )  # fmt: skip


METHODS = (Method(
    name="wall-friction",
    title="Wall friction",
    about="A bed under a load slides on a plate; a test a load.",
    questions=(
        Question("stress", "shear stress on the plate, each reading", "wall_shear_stress_kPa",
                 reading=True, example="0.6 kPa",
                 headings=("wandschubspannung", "schubspannung", "contrainte de cisaillement",
                           "shear stress")),
        Question("angle", "or the angle of wall friction", "wall_friction_angle_deg",
                 reading=True, most=89.0, example="", headings=("wandreibungswinkel",)),
        Question("load", "normal stress", "normal_stress_kPa", needed=True, example="2 kPa",
                 headings=NORMAL_STRESS),
        wall_question("what the plate is of"),
    ),
    rank=32,
    becomes=becomes,
    spread=True,
    leads=True,
    under="load",
    scatter=about_a_line,
    scatter_about="the line through {n} loads",
),)  # fmt: skip
