"""Beds that are sheared under a load: points of a yield locus in a shear cell, and friction on a
plate (Jenike); and grains on a plate: how high one that is dropped rebounds, and at what angle some
that cannot roll slide."""

import math
from statistics import fmean, stdev

import numpy as np

from calibration.study.new.assumed import ASSUMED
from calibration.study.new.grains import Grains
from calibration.study.new.methods import Entry, LaboratoryTest
from calibration.study.new.methods.declare import refusal, rows_of, said, simulated
from dem.units import has_unit

RESTITUTION = "contacts.particle_wall.restitution"
FRICTION = "contacts.particle_wall.static_friction"


def around(value: float, error: float) -> tuple[float, float]:
    """(low, high) about a measured value: some standard errors to either side, and a share of
    itself at least, so that the range does not decide what the data say."""
    half = max(ASSUMED.band_errors * error, ASSUMED.band_least * value)
    return round(max(value - half, 0.25 * value), 4), round(value + half, 4)


def mean_and_error(rows: list[dict]) -> tuple[float, float]:
    """Mean of rows and its standard error."""
    values = [row["value"] for row in rows]
    if len(values) == 1:
        return values[0], rows[0]["sd"] / math.sqrt(rows[0]["n"])
    return fmean(values), stdev(values) / math.sqrt(len(values))


def dropped(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `drop` at the laboratory's height; its restitution is the root of rebound
    over height, as falls of millimetre grains are (no drag)."""
    height = entry.value("height")
    for answer in entry.answers["rebound"]:
        if answer.value >= height:
            raise refusal("no_rebound", answer.place, answer.value, height)
        doubtful = answer.value < ASSUMED.doubtful_rebound * height
        if doubtful and not has_unit(answer.text.replace(",", ".")):
            raise refusal("doubtful_rebound", answer.place, answer.value, height)
    least = ASSUMED.smallest_drop_mm
    if grains.diameter_mm < least:
        raise refusal("floating", entry.place("rebound"), grains.diameter_mm, least)
    rows = rows_of(entry, "rebound", "drop", drop_height_mm=height)
    mean, error = mean_and_error(rows)
    restitution = math.sqrt(mean / height)
    spread = 0.5 * restitution * error / mean
    source = (
        f"measured: a rebound of {mean:.4g} mm from {height:g} mm is a restitution of "
        f"{restitution:.3f} ± {spread:.3f}"
    )
    went = {"rebound": f"a target, and the range of restitution on the wall ({restitution:.3f})"}
    return simulated(
        entry, "rebound", f"drop_{height:.6g}_mm".replace(".", "_"), "drop",
        {"particles": {"count": 1} | grains.single(), "geometry": {"drop_height_mm": height}},
        rows, went=went, ranges={RESTITUTION: (*around(restitution, spread), source)},
        said=said("drop", source, bool(grains.spheres)),
    )  # fmt: skip


def about_one_restitution(height: np.ndarray, rebound: np.ndarray) -> np.ndarray:
    """Standard deviation (n,) of single rebounds (n,) from heights (n,): the scatter of their
    restitutions about the mean, twice as large a part of a rebound as of its restitution."""
    restitution = np.sqrt(rebound / height)
    return 2.0 * restitution.std(ddof=1) / restitution.mean() * rebound


def tilted(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `tilt`: bonded grains, so that none rolls; its tangent is the friction."""
    rows = rows_of(entry, "angle", "tilt")
    mean, error = mean_and_error(rows)
    friction = math.tan(math.radians(mean))
    spread = math.radians(error) * (1.0 + friction**2)
    source = (
        f"measured: a sliding angle of {mean:.4g}° is a friction of {friction:.3f} ± {spread:.3f}"
    )
    plate = ASSUMED.plate_length_mm, ASSUMED.plate_width_mm
    length, width = (max(x, ASSUMED.plate_grains * grains.diameter_mm) for x in plate)
    geometry = {"tilt_rate_deg_s": entry.value("rate", 5.0), "trials": 2,
                "plate_length_mm": round(length, 3), "plate_width_mm": round(width, 3),
                "spacing_mm": round(grains.diameter_mm, 4)}  # fmt: skip
    went = {"angle": f"a target, and the range of friction on the wall ({friction:.3f})"}
    return simulated(
        entry, "angle", "plane", "tilt",
        {"particles": {"count": 4} | grains.single(), "geometry": geometry},
        rows, went=went, ranges={FRICTION: (*around(friction, spread), source)}, said=(source,),
        known={FRICTION: (friction, spread)},
    )  # fmt: skip


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
        "inner_diameter_mm": round(ASSUMED.ring_inner * length, 4),
        "outer_diameter_mm": round(ASSUMED.ring_outer * length, 4),
        "shear_speed_mm_s": round(15.0 * length, 4),
        "preshear_displacement_mm": round(2.0 * length, 4),
        "shear_displacement_mm": round(3.0 * length, 4),
    }
    if entry.values("preshear"):
        geometry["preshear_normal_stress_kPa"] = entry.value("preshear")
    count = ASSUMED.ring_grains * grains.longest**3
    return simulated(
        entry, "stress", f"shear_{load:g}_kPa".replace(".", "_"), "shear",
        {"particles": grains.particles(count, diameter), "geometry": geometry,
         "numerics": {"overlap_limit": ASSUMED.ring_overlap}},
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
        "ring_diameter_mm": round(ASSUMED.wall_ring * length, 4),
        "slide_speed_mm_s": round(10.0 * length, 4),
        "slide_mm": round(2.0 * length, 4),
    }
    key = "stress" if entry.values("stress") else "angle"
    return simulated(
        entry, key, f"wall_{load:g}_kPa".replace(".", "_"), EXPERIMENT,
        {"particles": grains.particles(ASSUMED.wall_grains * grains.longest**2, diameter),
         "geometry": geometry},
        rows_of(entry, key, EXPERIMENT, normal_stress_kPa=load),
    )  # fmt: skip
