"""Effects hidden in drops and slides of the engine, diagnosed as such tables are: by free laws and
the integrated contact.

Data are drawn by the real engine at other seeds, another time step and other base parameters, at
the strengths in STRENGTHS: each moves one setting of the plan by ten standard errors.
"""

import math
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.rates.kept_rates import KEPT, ROOT, WORDS, Trial, figures
from benchmarks.rates.simulated import rate_settings, salt_heap
from calibration.intake.measurements import OUTCOMES, Measurement
from calibration.intake.quantities import QUANTITIES, Condition
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay
from dem.constants import GRAVITY
from dem.spec import parse_spec
from diagnosis import contacts
from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of

STRENGTHS = KEPT / "strengths.csv"
POINTS, FIRST = 4, 1000
"""Points in the space of the parameters, and the first of them and of the seeds: those below were
looked at while the method was made."""

NOISE = {"drop": 0.02, "tilt": 0.4}
"""Standard deviation of one reading: a share of the value where that is its quantity's way, else in
its unit."""

REPLICATES = 5
"""Readings of a condition."""

STEP = {"drop": 0.8, "tilt": 1.25}
"""Time step over that of the diagnosis."""

PLAN = [
    (str(row.pop("experiment")), {lever: level for lever, level in row.items() if level == level})
    for row in pd.read_csv(Path(__file__).with_suffix(".csv")).to_dict("records")
]
"""(experiment, levers): what a laboratory measures that wants to tell mechanisms apart, each lever
at its ends and between. The lower drops rebound once more with an ordinary camera, of 25 frames a
second beside 100: free of charge, and it shows what the camera does."""


@dataclass(frozen=True)
class Case:
    """A table: what is hidden in it, at which point, and the seed of its noise. `removed`: what is
    hidden is taken out of the catalogue."""

    case: str
    truth: str
    point: int
    seed: int


def planned() -> list[Case]:
    """Return the nulls, and each mechanism in the catalogue and taken out of it; point after point,
    so that a part of them is a fair one."""
    own = [
        Case("no effect", "", FIRST + point, FIRST + seed + point)
        for seed in range(0, 40, 8)
        for point in range(POINTS)
    ]
    own += [
        Case(kind, name, FIRST + point, FIRST + 100 + point)
        for name in strengths()
        for point in range(POINTS)
        for kind in ("mechanism", "removed")
    ]
    return sorted(own, key=lambda c: (c.point, c.seed, c.truth, c.case))


def strengths() -> dict[str, float]:
    """Return {mechanism: strength in its unit}: the weakest that moves a setting of the plan by ten
    standard errors beyond what the base model takes up."""
    kept = pd.read_csv(STRENGTHS)
    return dict(zip(kept["mechanism"], kept["strength"], strict=True))


@cache
def study() -> tuple[Rig, dict]:
    """Return rig and catalogue."""
    base = salt_heap()
    settings = rate_settings()
    factors = parameters_of(settings, ROOT / "config/factors.tsv", ["drop", "tilt"])
    return Rig(settings, base, tuple(factors)), load_catalogue()


@cache
def measured(truth: str, point: int, seed: int) -> list[Measurement]:
    """Return measurements of PLAN with an effect switched on; those of `mechanism` and `removed`
    are the same.

    `point` draws the base parameters from the middle 60 % of their ranges. `seed` and the effect
    draw the noise of each condition. A run that gives no value is a row with that outcome.
    """
    rig, catalogue = study()
    strength = strengths().get(truth, 0.0)
    rng = np.random.default_rng([point, 20_011])
    values = {f.name: f.natural(float(rng.uniform(-0.6, 0.6))) for f in rig.factors}
    rows = []
    for experiment, levers in PLAN:
        spec = rig.spec(Condition(experiment, levers), 50_000 + 100 * point, values)
        step = STEP[experiment] * parse_spec(spec).numerics.rayleigh_fraction
        spec = overlay(spec, {"numerics": {"rayleigh_fraction": step}})
        by_camera = truth == "apex_sampling"
        if truth and not by_camera and experiment in catalogue[truth].experiments:
            if truth == "tilt_detection_lag":  # sliding counts only after this much movement
                seen = max(strength, spec["geometry"]["slip_mm"])
                spec = overlay(spec, {"geometry": {"slip_mm": seen}})
            spec = catalogue[truth].apply(spec, strength)
        [metrics] = simulate(named([spec])).values()
        if metrics is None:
            rows.append(
                Measurement(
                    experiment, math.nan, math.nan, 1, dict(levers),
                    outcome=OUTCOMES[0], quantity=QUANTITIES[experiment].name,
                )
            )  # fmt: skip
            continue
        value = metrics[str(rig.settings.experiments[experiment].metric)]
        # the same whatever else is measured, others for other effects
        effects = [(truth, strength)] if truth else []
        label = repr((experiment, sorted(levers.items()), effects))
        noise = np.random.default_rng([seed, zlib.crc32(label.encode())])
        rows.append(_read(experiment, levers, value, noise, strength if by_camera else 0.0))
    return rows


def _read(experiment, levers, value, rng, frame_factor):
    """Mean and spread of noisy readings; frame_factor times the frame interval is what the camera
    really had."""
    noise = NOISE[experiment] * (value if QUANTITIES[experiment].relative else 1.0)
    sample = value + noise * rng.standard_normal(REPLICATES)
    if experiment == "drop" and frame_factor:
        # each replicate's apex falls at a phase of its own between two frames
        phase = rng.uniform(-0.5, 0.5, REPLICATES)
        away = frame_factor * levers.get("output_interval_s", 0.0) * phase
        sample = sample - 1e3 * 0.5 * GRAVITY * away**2
    sd = float(sample.std(ddof=1))
    return Measurement(experiment, float(sample.mean()), sd, REPLICATES, dict(levers))


def judged(case: Case) -> dict[str, Any]:
    """Return the row of a case."""
    rig, known = study()
    catalogue = {n: m for n, m in known.items() if case.case != "removed" or n != case.truth}
    found = contacts.discovered(measured(case.truth, case.point, case.seed), rig, catalogue)
    assert found is not None  # drops and slides are judged by free laws
    slot, state = next(((law["slot"], tuple(law["state"])) for law in found.laws), ("", ()))
    names = found.causes if found.verdict == "identified" else []
    right = bool(case.truth) and names == [case.truth]
    return {
        "case": case.case,
        "truth": case.truth,
        "seed": case.seed,
        "verdict": found.verdict,
        "causes": " + ".join(found.causes),
        "slot": slot,
        "state": " x ".join(state),
        "right_law": int(bool(case.truth) and (slot, state) == known[case.truth].law),
        "right_name": int(right),
        "wrong_name": int(bool(names) and (not right or case.case == "removed")),
        "p": round(found.p, 4),
    }


def told(rows: pd.DataFrame) -> str:
    """Return Markdown: the rates, the verdicts, the mechanisms one by one."""
    count = rows.groupby(["case", "verdict"]).size().to_dict()
    hidden = rows[rows["case"] == "mechanism"].groupby("truth")
    return WORDS.single_grains(figures("single_grains", rows), count, hidden)


TRIAL = Trial("single_grains", "contacts", planned, judged, told)
