"""Beds that are sheared under a load: points of a yield locus in a shear cell, and friction on a
plate (Jenike)."""

import numpy as np

from calibration.study.new.grains import Grains
from calibration.study.new.methods.declare import (
    Entry,
    LaboratoryTest,
    refusal,
    rows_of,
    said,
    simulated,
)

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
        raise refusal("stress_or_angle", entry.place("load"))
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
