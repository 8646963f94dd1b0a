"""Drops and slides with a hidden effect: the real engine at other seeds, another time step and
other base parameters."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from calibration.intake.measurements import OUTCOMES, Measurement
from calibration.intake.quantities import QUANTITIES, Condition
from calibration.runs.simulated import named, simulate
from dem.constants import GRAVITY
from dem.spec import parse_spec

if TYPE_CHECKING:
    from diagnosis.catalogue import Mechanism
    from diagnosis.rig import Rig


NOISE = {"drop": 0.02, "tilt": 0.4}
"""Standard deviation of one reading: a share of the value where that is its quantity's way, else in
its unit."""

REPLICATES = 5
"""Readings of a condition."""

STEP = {"drop": 0.8, "tilt": 1.25}
"""Time step over that of the diagnosis."""

FILM_S, FAST_FILM_S = 0.04, 0.01  # 25 and 100 frames a second
PLAN = [
    # the lower rebounds once more with an ordinary camera: free of charge, and it shows what the
    # camera does
    *(
        ("drop", {"drop_height_mm": h, "particle_diameter_mm": d, "output_interval_s": film})
        for film, heights in ((FAST_FILM_S, (50.0, 110.0, 250.0)), (FILM_S, (50.0, 110.0)))
        for d in (1.0, 2.0, 4.0)
        for h in heights
    ),
    *(
        ("tilt", {"tilt_rate_deg_s": w, "particle_diameter_mm": d})
        for d in (1.0, 1.6, 2.5, 4.0)
        for w in (4.0, 20.0)
    ),
]
"""What a laboratory measures that wants to tell mechanisms apart: each lever at its ends and
between."""


def draw(
    point: int,
    rig: Rig,
    catalogue: Mapping[str, Mechanism],
    effects: Mapping[str, float],
    seed: int,
) -> list[Measurement]:
    """Return measurements of PLAN with `effects` {name: strength in its unit} switched on.

    `point` draws the base parameters from the middle 60 % of their ranges. `seed` and the effects
    draw the noise of each condition. A run that gives no value is a row with that outcome.
    """
    rng = np.random.default_rng([point, 20_011])
    values = {f.name: f.natural(float(rng.uniform(-0.6, 0.6))) for f in rig.factors}
    measured = []
    for experiment, levers in PLAN:
        spec = _own_step(rig.spec(Condition(experiment, levers), 50_000 + 100 * point, values))
        for name, strength in effects.items():
            if experiment in catalogue[name].experiments and name != "apex_sampling":
                spec = catalogue[name].apply(spec, strength)
        [metrics] = simulate(named([spec])).values()
        if metrics is None:
            measured.append(
                Measurement(
                    experiment, math.nan, math.nan, 1, dict(levers),
                    outcome=OUTCOMES[0], quantity=QUANTITIES[experiment].name,
                )
            )  # fmt: skip
            continue
        value = metrics[str(rig.settings.experiments[experiment].metric)]
        # the same whatever else is measured, others for other effects
        label = repr((experiment, sorted(levers.items()), sorted(effects.items())))
        noise = np.random.default_rng([seed, zlib.crc32(label.encode())])
        frames = effects.get("apex_sampling", 0.0)
        measured.append(_read(experiment, levers, value, noise, frames))
    return measured


def _own_step(spec):
    """Another time step than the diagnosis takes."""
    step = STEP[spec["experiment"]] * parse_spec(spec).numerics.rayleigh_fraction
    return spec | {"numerics": spec["numerics"] | {"rayleigh_fraction": step}}


def _read(experiment, levers, value, rng, frame_factor):
    """Mean and spread of noisy readings; frame_factor times the frame interval is what the camera
    really had."""
    n = REPLICATES
    noise = NOISE[experiment] * (value if QUANTITIES[experiment].relative else 1.0)
    sample = value + noise * rng.standard_normal(n)
    if experiment == "drop" and frame_factor:
        # each replicate's apex falls at a phase of its own between two frames
        away = frame_factor * levers.get("output_interval_s", 0.0) * rng.uniform(-0.5, 0.5, n)
        sample = sample - 1e3 * 0.5 * GRAVITY * away**2
    return Measurement(experiment, float(sample.mean()), float(sample.std(ddof=1)), n, dict(levers))
