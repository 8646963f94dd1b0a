"""Test data with a hidden effect: the real engine at other seeds, another time step and other base parameters."""

from dataclasses import replace

import numpy as np

from calibration.discrepancy.measurements import Measurement
from calibration.discrepancy.runs import named, simulate
from calibration.discrepancy.settings import condition_spec, parameters_of

GRAVITY = 9.81
NOISE = {
    "drop": ("relative", 0.02),
    "tilt": ("absolute", 0.4),
    "shear": ("relative", 0.03),
    "heap": ("absolute", 1.0),
}
"""Standard deviation of one replicate: of the value, or in degrees."""

DESIGN = [
    *[
        ("drop", {"drop_height_mm": h, "particle_diameter_mm": d})
        for d in (1.2, 3.0)
        for h in (50.0, 100.0, 200.0, 400.0)
    ],
    *[
        ("tilt", {"tilt_rate_deg_s": w, "particle_diameter_mm": d})
        for d in (1.4, 2.0, 2.8, 4.0)
        for w in (8.0, 20.0)
    ],
]
"""Conditions of the benchmark: every lever of drop and tilt at several settings."""

FRAME_S = (0.01, 0.02, 0.033, 0.05)  # 100 to 20 frames a second


def with_frames(design):
    """The design with the camera's frame interval, which changes from one drop to the next."""
    drops = iter(range(len(design)))
    return [
        (e, x | {"output_interval_s": FRAME_S[(next(drops) * 3) % 4]}) if e == "drop" else (e, x)
        for e, x in design
    ]


def draw(
    seed,
    settings,
    base,
    factors_file,
    catalogue,
    effects=None,
    replicates=5,
    noise=1.0,
    design=None,
    root="results/runs",
):
    """(measurements, truth): data with `effects` {name: strength as a share of the moderate one} switched on.

    The base parameters are drawn from the middle 60 % of their ranges by `seed`. truth says what was drawn.
    """
    rng = np.random.default_rng([seed, 20_011])
    design = with_frames(DESIGN if design is None else design)
    kinds = list(dict.fromkeys(e for e, _ in design))
    factors = parameters_of(settings, factors_file, kinds)
    values = {f.name: f.natural(float(rng.uniform(-0.6, 0.6))) for f in factors}
    strengths = {n: catalogue[n].strength.share(s) for n, s in (effects or {}).items()}
    specs = []
    for k, (experiment, levers) in enumerate(design):
        spec = condition_spec(
            base, settings, factors, experiment, levers, values, 50_000 + 100 * seed + k
        )
        specs.append(_hide(_finer(spec), experiment, levers, catalogue, strengths))
    metrics = simulate(named(specs), root)
    if any(v is None for v in metrics.values()):
        raise RuntimeError(f"the hidden effect {strengths} cannot be simulated with {values}")
    measured = [
        _read(
            experiment,
            levers,
            metrics[name][settings.experiments[experiment].metric],
            replicates,
            noise,
            rng,
            strengths.get("apex_sampling", 0.0),
        )
        for (experiment, levers), name in zip(design, named_list(specs), strict=True)
    ]
    return measured, {"effects": strengths, "parameters": values}


def named_list(specs):
    """Run ids of specs, in order."""
    return [next(iter(named([s]))) for s in specs]


def _finer(spec):
    """Another time step than the diagnosis takes."""
    numerics = spec["numerics"]
    return spec | {
        "numerics": numerics | {"rayleigh_fraction": 1.25 * numerics["rayleigh_fraction"]}
    }


def _hide(spec, experiment, levers, catalogue, strengths):
    for name, strength in strengths.items():
        if experiment in catalogue[name].experiments and name != "apex_sampling":
            spec = catalogue[name].apply(spec, strength)
    return spec


def _read(experiment, levers, value, replicates, noise, rng, frame_factor):
    """Mean and spread of noisy readings; frame_factor times the frame interval is what the camera really had."""
    kind, size = NOISE[experiment]
    sd = noise * (size * value if kind == "relative" else size)
    sample = value + sd * rng.standard_normal(replicates)
    if experiment == "drop" and frame_factor:
        # each replicate's apex falls at a phase of its own between two frames
        away = frame_factor * levers["output_interval_s"] * rng.uniform(-0.5, 0.5, replicates)
        sample = sample - 1e3 * 0.5 * GRAVITY * away**2
    return Measurement(
        experiment, float(sample.mean()), float(sample.std(ddof=1)), replicates, dict(levers)
    )


def outlier(measurements, seed):
    """The measurements with one replicate of one setting six standard deviations off; mean and sd follow."""
    rng = np.random.default_rng([seed, 3])
    k = int(rng.integers(len(measurements)))
    m = measurements[k]
    off = 6.0 * m.sd * rng.choice([-1.0, 1.0])
    sd = np.sqrt(m.sd**2 + off**2 / m.n)
    return [
        *measurements[:k],
        replace(m, value=m.value + off / m.n, sd=float(sd)),
        *measurements[k + 1 :],
    ]


def understated(measurements, factor=2.0):
    """The measurements with their spreads stated smaller than they are."""
    return [replace(m, sd=m.sd / factor) for m in measurements]
