"""Grains on a plate that is tilted until they slide."""

import math

from calibration.study.new.grains import Grains
from calibration.study.new.methods.declare import (
    Entry,
    LaboratoryTest,
    Method,
    Question,
    around,
    mean_and_error,
    rows_of,
    simulated,
    wall_question,
)

KEY = "contacts.particle_wall.static_friction"
PLATE_MM = (80.0, 60.0)
WIDER = 4.0  # grains that a plate is long and wide at least


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
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
        rows, went=went, ranges={KEY: (*around(friction, spread), source)}, said=(source,),
    )  # fmt: skip


METHODS = (Method(
    name="tilted-plane",
    title="Tilted plane",
    about="Grains that cannot roll (three or four glued together) lie on a plate, which is tilted "
    "until they slide.",
    questions=(
        Question("angle", "angle at which they slide, each reading", "sliding_angle_deg",
                 reading=True, needed=True, most=89.0, example="21",
                 headings=("gleitwinkel", "rutschwinkel", "angle de glissement", "winkel")),
        Question("rate", "speed of tilting", "tilt_rate_deg_s", most=90.0, example=""),
        wall_question("what the plate is of"),
    ),
    rank=41,
    becomes=becomes,
    spread=True,
),)  # fmt: skip
