"""Test data with a hidden effect: the real engine at other seeds, another time step and other base
parameters."""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.intake.measurements import OUTCOMES, Measurement
from calibration.intake.quantities import POURED, QUANTITIES, Condition
from calibration.runs.simulated import named, simulate
from dem.constants import GRAVITY
from dem.spec import parse_spec

if TYPE_CHECKING:
    from pathlib import Path

    from diagnosis.catalogue import Mechanism
    from diagnosis.rig import Rig


NOISE = {"drop": 0.02, "tilt": 0.4, "shear": 0.03, "heap": 1.0}
"""Standard deviation of one reading: a share of the value where that is its quantity's way, else in
its unit."""

REPLICATES = {"drop": 5, "tilt": 5, "shear": 4, "heap": 5}
"""Readings of a condition; of a poured experiment each is a run of its own."""

STEP = {"drop": 0.8, "heap": 0.8}
"""Time step over that of the diagnosis, 1.25 elsewhere: a coarser one would itself be an effect, on
a flat heap of up to a degree and a half."""

FILM_S, FAST_FILM_S = 0.04, 0.01  # 25 and 100 frames a second
DROPS = [
    *[
        ("drop", {"drop_height_mm": h, "particle_diameter_mm": d, "output_interval_s": FAST_FILM_S})
        for d in (1.0, 2.0, 4.0)
        for h in (50.0, 110.0, 250.0)
    ],
    # the lower rebounds once more with an ordinary camera: free of charge, and it shows what the
    # camera does
    *[
        ("drop", {"drop_height_mm": h, "particle_diameter_mm": d, "output_interval_s": FILM_S})
        for d in (1.0, 2.0, 4.0)
        for h in (50.0, 110.0)
    ],
]
TILTS = [
    ("tilt", {"tilt_rate_deg_s": w, "particle_diameter_mm": d})
    for d in (1.0, 1.6, 2.5, 4.0)
    for w in (4.0, 20.0)
]
HEAP_LEVELS = {
    "particle_diameter_mm": (3.6, 2.8, 4.6),
    "discharge_height_mm": (90.0, 60.0, 130.0),
    "particle_count": (700.0, 400.0, 1200.0),
}
"""Lever -> centre, low, high."""

HEAPS = [
    ("heap", {name: levels[k] for (name, levels), k in zip(HEAP_LEVELS.items(), at, strict=True)})
    for at in itertools.product((0, 1, -1), repeat=3)
    if sum(k != 0 for k in at) != 2 and at[1:] != (-1, 1)
]
"""A face-centred composite design: centre, faces and corners; the centre first. Not the two corners
in which the fewest grains fall deepest: they splash, and what is left is no heap."""

SHEARS = [("shear", {"normal_stress_kPa": s}) for s in (0.5, 0.65, 0.85, 1.2, 2.5)]
PLANS = {"grains": DROPS + TILTS, "heap": DROPS + HEAPS, "shear": SHEARS + HEAPS}
"""What a laboratory measures that wants to tell mechanisms apart: each lever at its ends and
between."""

ALIKE = {
    ("viscoelastic_restitution", "plastic_restitution"): (
        "grains",
        [
            ("drop", {"drop_height_mm": h, "particle_diameter_mm": 2.0})
            for h in (50.0, 80.0, 110.0, 170.0, 250.0)
        ],
    ),
    ("wall_adhesion", "stress_dependent_friction"): (
        "grains",
        [
            ("tilt", {"tilt_rate_deg_s": 20.0, "particle_diameter_mm": d})
            for d in (1.3, 1.6, 2.0, 2.5, 4.0)
        ],
    ),
    ("cohesion", "uncounted_load"): ("shear", [*SHEARS, HEAPS[0]]),
}
"""Two mechanisms -> bench and a plan on which they look alike: one lever, or one experiment."""


def draw(
    point: int,
    rig: Rig,
    catalogue: Mapping[str, Mechanism],
    effects: Mapping[str, float] | None = None,
    seed: int | None = None,
    plan: Sequence[tuple[str, dict[str, float]]] = PLANS["grains"],
    root: str | Path | None = None,
) -> tuple[list[Measurement], dict[str, Any]]:
    """(measurements, truth): data with `effects` {name: strength in its unit} switched on.

    `point` draws the base parameters from the middle 60 % of their ranges. `seed` (that of the
    point unless given) and the effects draw the noise of each condition. Runs that give no value,
    in a funnel that clogs, are a row with that outcome. A single reading beside them has no spread
    and is left out. truth says what was drawn.
    """
    rng = np.random.default_rng([point, 20_011])
    values = {f.name: f.natural(float(rng.uniform(-0.6, 0.6))) for f in rig.factors}
    strengths = dict(effects or {})
    measured = []
    for experiment, levers in plan:
        runs = REPLICATES[experiment] if experiment in POURED else 1
        specs = [
            rig.spec(Condition(experiment, levers), 50_000 + 100 * point + k, values)
            for k in range(runs)
        ]
        specs = [_hide(_own_step(s), experiment, catalogue, strengths) for s in specs]
        metric = rig.settings.experiments[experiment].metric
        read = [m[metric] for m in simulate(named(specs), root).values() if m is not None]  # type: ignore[index]
        n = REPLICATES[experiment] - (runs - len(read))
        if len(read) == runs or len(read) > 1:
            noise = _noise([point if seed is None else seed], experiment, levers, strengths)
            frames = strengths.get("apex_sampling", 0.0)
            measured.append(_read(experiment, levers, read, n, noise, frames))
        if len(read) < runs:
            measured.append(_without_value(experiment, levers, runs - len(read)))
    return measured, {"effects": strengths, "parameters": values}


def _own_step(spec):
    """Another time step than the diagnosis takes."""
    own = parse_spec(spec).numerics.rayleigh_fraction
    step = STEP.get(spec["experiment"], 1.25) * own
    return spec | {"numerics": spec["numerics"] | {"rayleigh_fraction": step}}


def _hide(spec, experiment, catalogue, strengths):
    for name, strength in strengths.items():
        if experiment in catalogue[name].experiments and name != "apex_sampling":
            spec = catalogue[name].apply(spec, strength)
    return spec


def _noise(seed, experiment, levers, strengths):
    """Random numbers of one condition: the same whatever else is measured, others for other
    effects."""
    label = repr((experiment, sorted(levers.items()), sorted(strengths.items())))
    return np.random.default_rng([*seed, zlib.crc32(label.encode())])


def _without_value(experiment, levers, n):
    own = {"outcome": OUTCOMES[0], "quantity": QUANTITIES[experiment].name}
    return Measurement(experiment, math.nan, math.nan, n, dict(levers), **own)


def _read(experiment, levers, values, n, rng, frame_factor):
    """Mean and spread of n noisy readings; frame_factor times the frame interval is what the camera
    really had."""
    sample = np.resize(values, n) + _spread(experiment, np.mean(values)) * rng.standard_normal(n)
    if experiment == "drop" and frame_factor:
        # each replicate's apex falls at a phase of its own between two frames
        away = frame_factor * levers.get("output_interval_s", 0.0) * rng.uniform(-0.5, 0.5, n)
        sample = sample - 1e3 * 0.5 * GRAVITY * away**2
    return Measurement(experiment, float(sample.mean()), float(sample.std(ddof=1)), n, dict(levers))


def _spread(experiment, value):
    """Standard deviation of one reading of a value, or of values (k,)."""
    return NOISE[experiment] * (value if QUANTITIES[experiment].relative else np.ones_like(value))


def standard_error(
    experiment: str, value: np.ndarray | float, scatter: np.ndarray | float = 0.0
) -> np.ndarray:
    """Standard errors (k,) of the means (k,) that this laboratory finds in an experiment.

    scatter: sd of the value from run to run, where each reading is one of a run of its own.
    """
    return np.hypot(_spread(experiment, value), scatter) / REPLICATES[experiment] ** 0.5


def outlier(measurements: Sequence[Measurement], seed: int) -> list[Measurement]:
    """The measurements with one replicate of one setting six standard deviations off; mean and sd
    follow. Tests that ended without a value have none."""
    rng = np.random.default_rng([seed, 3])
    valued = [k for k, m in enumerate(measurements) if not m.outcome]
    k = valued[int(rng.integers(len(valued)))]
    m = measurements[k]
    off = 6.0 * m.sd * rng.choice([-1.0, 1.0])  # type: ignore[operator]
    sd = np.sqrt(m.sd**2 + off**2 / m.n)  # type: ignore[operator]
    return [
        *measurements[:k],
        replace(m, value=m.value + off / m.n, sd=float(sd)),
        *measurements[k + 1 :],
    ]


def understated(
    measurements: Sequence[Measurement], seed: int | None = None, factor: float = 2.0
) -> list[Measurement]:
    """The measurements with their spreads stated smaller than they are: the noise is twice what it
    claims to be."""
    return [replace(m, sd=m.sd / factor) for m in measurements]  # type: ignore[operator]
