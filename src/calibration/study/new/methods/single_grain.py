"""Tests of grains on a plate: how high one that is dropped rebounds, and at what angle some that
cannot roll slide."""

import math

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
from dem.units import has_unit

RESTITUTION = "contacts.particle_wall.restitution"
DOUBTFUL = 0.01  # of the height of the drop: a bare rebound below it is asked about
SMALLEST_MM = 0.3
"""Diameter below which drag decides a fall: a grain of 0.3 mm and 2.5 g/cm3 sinks in air at no
more than 2 m/s."""
FRICTION = "contacts.particle_wall.static_friction"
PLATE_MM = (80.0, 60.0)
WIDER = 4.0  # grains that a plate is long and wide at least
BAND_ERRORS, BAND_LEAST = 4.0, 0.2  # of a measured value


def around(value: float, error: float) -> tuple[float, float]:
    """(low, high) about a measured value: BAND_ERRORS of its standard errors to either side, and
    BAND_LEAST of itself at least, so that the range does not decide what the data say."""
    half = max(BAND_ERRORS * error, BAND_LEAST * value)
    return round(max(value - half, 0.25 * value), 4), round(value + half, 4)


def mean_and_error(rows: list[dict]) -> tuple[float, float]:
    """Mean of rows and its standard error."""
    values = [row["value"] for row in rows]
    mean = sum(values) / len(values)
    if len(values) == 1:
        return mean, rows[0]["sd"] / math.sqrt(rows[0]["n"])
    square = sum((v - mean) ** 2 for v in values) / (len(values) - 1)
    return mean, math.sqrt(square / len(values))


def dropped(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `drop` at the laboratory's height; its restitution is the root of rebound
    over height, as falls of millimetre grains are (no drag)."""
    height = entry.value("height")
    for answer in entry.answers["rebound"]:
        if answer.value >= height:
            raise refusal("no_rebound", answer.place, answer.value, height)
        if answer.value < DOUBTFUL * height and not has_unit(answer.text.replace(",", ".")):
            raise refusal("doubtful_rebound", answer.place, answer.value, height)
    if grains.diameter_mm < SMALLEST_MM:
        raise refusal("floating", entry.place("rebound"), grains.diameter_mm, SMALLEST_MM)
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
    length, width = (max(x, WIDER * grains.diameter_mm) for x in PLATE_MM)
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
