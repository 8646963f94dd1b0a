"""Beds that are sheared under a load: points of a yield locus in a shear cell, and friction on a
plate (Jenike)."""

import numpy as np

from calibration.errors import CalibrationError
from calibration.study.new.grains import Grains
from calibration.study.new.methods.declare import (
    Entry,
    LaboratoryTest,
    Method,
    Question,
    rows_of,
    said,
    simulated,
    wall_question,
)

NORMAL_STRESS = ("normalspannung", "auflast", "contrainte normale", "normal load", "normal",
                 "sigma", "σ")  # fmt: skip
"""What tables call the load of a test."""

INNER, OUTER, COUNT = 10.0, 22.0, 1300
"""Walls of the ring in longest grains, and the grains in it: the salt's ring, in which they lie
four deep."""
DEEPEST = 0.8
"""Overlap over radius at which a run stops, as in the salt's shear: a grain that is caught at a
vane bears a large part of the lid's load."""
ACROSS, ON_A_WALL = 12.0, 800
"""Longest grains across the ring, and the grains in it: the experiment's own."""

EXPERIMENT = "wall_friction"


def about_a_line(load: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """Standard deviation (n,) of single stresses (n,) under loads (n,): their scatter about the
    line through them."""
    line = np.polynomial.Polynomial.fit(load, stress, 1)
    return np.full(len(load), np.sqrt(np.sum((stress - line(load)) ** 2) / (len(load) - 2)))


def sheared(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `shear` under the entry's load, in a ring that is as wide as the grains
    need."""
    load = entry.value("load")
    diameter = grains.size(grains.diameter_mm)
    length = grains.longest * diameter
    geometry = {
        "normal_stress_kPa": load,
        "inner_diameter_mm": round(INNER * length, 4),
        "outer_diameter_mm": round(OUTER * length, 4),
        "shear_speed_mm_s": round(15.0 * length, 4),
        "preshear_displacement_mm": round(2.0 * length, 4),
        "shear_displacement_mm": round(3.0 * length, 4),
    }
    if entry.values("preshear"):
        geometry["preshear_normal_stress_kPa"] = entry.value("preshear")
    count = COUNT * grains.longest**3
    return simulated(
        entry, "stress", f"shear_{load:g}_kPa".replace(".", "_"), "shear",
        {"particles": grains.particles(count, diameter), "geometry": geometry,
         "numerics": {"overlap_limit": DEEPEST}},
        rows_of(entry, "stress", "shear", normal_stress_kPa=load),
        said=said("ring", grains.enlarged(diameter)),
    )  # fmt: skip


def slid(entry: Entry, grains: Grains) -> LaboratoryTest:
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
        {"particles": grains.particles(ON_A_WALL * grains.longest**2, diameter),
         "geometry": geometry},
        rows_of(entry, key, EXPERIMENT, normal_stress_kPa=load),
    )  # fmt: skip


METHODS = (Method(
    name="shear-cell",
    title="Shear cell",
    about="Grains are sheared under a load, and the peak of the shear stress is read; a test a "
    "load.",
    questions=(
        Question("stress", "peak of the shear stress, each reading", "shear_stress_kPa",
                 reading=True, needed=True, example="1.9 kPa",
                 headings=("schubspannung", "scherspannung", "contrainte de cisaillement", "tau",
                           "τ")),
        Question("load", "normal stress under which it was sheared", "normal_stress_kPa",
                 needed=True, example="2 kPa", headings=NORMAL_STRESS),
        Question("preshear", "normal stress of the pre-shear", "preshear_normal_stress_kPa",
                 example="6 kPa", headings=("anscherspannung", "pre-shear")),
    ),
    rank=31,
    becomes=sheared,
    leads=True,
    under="load",
    scatter=about_a_line,
    scatter_about="the line through {n} loads",
), Method(
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
    becomes=slid,
    leads=True,
    under="load",
    scatter=about_a_line,
    scatter_about="the line through {n} loads",
),)  # fmt: skip
