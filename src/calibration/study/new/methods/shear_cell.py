"""Points of a yield locus: shear stress under a load in a shear cell."""

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
)

INNER, OUTER, COUNT = 10.0, 22.0, 1300
"""Walls of the ring in longest grains, and the grains in it: the salt's ring, in which they lie
four deep."""
DEEPEST = 0.8
"""Overlap over radius at which a run stops, as in the salt's shear: a grain that is caught at a
vane bears a large part of the lid's load."""


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
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
        rows_of(entry, "stress", "shear", normal_stress_kPa=load), said=_said(grains, diameter),
    )  # fmt: skip


NARROW = (
    "the ring's walls are six grains apart and bear a part of the shear stress: in a ring half as "
    "wide again it was 9 and 16 % less (two materials, benchmarks/vessels.py)"
)


def _said(grains, diameter):
    larger = grains.enlarged(diameter)
    return (NARROW, f"the ring's grains are {larger}") if larger else (NARROW,)


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
    becomes=becomes,
    spread=True,
    leads=True,
    under="load",
    scatter=about_a_line,
    scatter_about="the line through {n} loads",
),)  # fmt: skip
