"""What the calibrated base model gets wrong: residuals along each lever, and a sentence for each
pattern.

Chances are simulated. A spread that few replicates give is an error itself, so a residual over it
follows no normal law. What the fit takes up of a pattern is not simulated: where many parameters
are calibrated the chances are upper bounds.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from calibration.figures import parameter_words
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES
from calibration.statistics.numbers import NORMAL_95
from diagnosis.chance import share_above
from diagnosis.design import WIDENED
from diagnosis.fit import Fit
from diagnosis.model import Model
from diagnosis.page.words import at as at_lever
from diagnosis.reading_errors import redrawn_error

P_TREND = 0.01
DRAWS = 4000


def by_chance(
    measurements: Sequence[Measurement], error: np.ndarray, sd: np.ndarray, draws: int = DRAWS
) -> np.ndarray:
    """Residuals (draws, n) that chance makes where nothing is missing, in units of the sd that the
    laboratory and the model would state.

    error: (n,) standard errors of the readings; sd: (n,) with the model's own beside them."""
    rng = np.random.default_rng(22)
    model = np.sqrt(np.maximum(sd**2 - error**2, 0.0))
    noise = error * rng.standard_normal((draws, len(error)))
    noise += model * rng.standard_normal((draws, len(error)))
    return noise / np.hypot(redrawn_error(measurements, error, draws, rng), model)


def tails(measurements: Sequence[Measurement], drawn: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Two-sided tail probabilities (n,) of settings that are `off` (n,), among the residuals
    `drawn` (r, n) of all settings of their experiment."""
    kinds = np.array([m.experiment for m in measurements])
    out = np.empty(len(kinds))
    for kind in set(kinds):
        own = kinds == kind
        out[own] = share_above(np.abs(drawn[:, own]).ravel(), np.abs(off[own]))
    return out


def residual_rows(
    measurements: Sequence[Measurement], fitted: Fit, drawn: np.ndarray, error: np.ndarray
) -> list[dict[str, Any]]:
    """A mapping for each condition: its levers and what was recorded beside, measured, predicted
    (with what its batch and its instrument add), its sd and that of the reading alone, residual in
    sd, tail probability when it is left out; drawn: see `by_chance`; error: (n,) of the
    readings."""
    tail = tails(measurements, drawn, fitted.residual[0] / np.sqrt(1.0 - fitted.leverage[0]))
    rows = []
    for i, m in enumerate(measurements):
        rows.append(
            {
                "experiment": m.experiment,
                "levers": m.levers | m.covariates,
                "measured": m.value,
                "predicted": float(fitted.expected[0, i]),
                "sd": float(fitted.sd[0, i]),
                "reading_sd": float(error[i]),
                "standardised": float(fitted.residual[0, i]),
                "predictive_p": float(tail[i]),
            }
        )
    return rows


def trends(rows: Sequence[dict[str, Any]], drawn: np.ndarray) -> list[dict[str, Any]]:
    """Return what the residuals show beyond noise: slopes along a lever, experiments off as a
    whole, single settings; drawn: see `by_chance`.

    Each mapping: kind (trend, offset or setting), experiment, lever and slope (None but for a
    trend), p, sentence."""
    out = []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        at = [k for k, r in enumerate(rows) if r["experiment"] == kind]
        own, noise = [rows[k] for k in at], drawn[:, at]
        levers = dict.fromkeys(n for r in own for n in r["levers"])
        found = [t for t in (_trend(kind, lever, own, noise) for lever in levers) if t]
        out += found or [o for o in (_offset(kind, own, noise),) if o]
    told = {p["experiment"] for p in out}
    return out + [
        _setting(r)
        for r in rows
        if r["experiment"] not in told and r["predictive_p"] < P_TREND / len(rows)
    ]


def _trend(kind, lever, rows, drawn):
    """The slope of the residuals along a lever, where it is more than noise (p below P_TREND)."""
    at = [k for k, r in enumerate(rows) if lever in r["levers"]]
    some = [rows[k] for k in at]
    x = np.array([r["levers"][lever] for r in some])
    if len(some) < 3 or len(set(x)) < 2:
        return None
    r = np.array([row["standardised"] for row in some])
    shape = np.log(x) if (x > 0.0).all() else x
    shape = shape - shape.mean()
    slope = float((shape * r).sum() / (shape**2).sum())
    p = share_above(np.abs(drawn[:, at] @ shape), abs(float(shape @ r)))
    if p > P_TREND:
        return None
    parts = []
    for end in (x.max(), x.min()):
        own = [row for row, v in zip(some, x, strict=True) if v == end]
        parts.append(f"{_distance(own)} at {at_lever(lever, end)}")
    sentence = f"The measured {QUANTITIES[kind].words} {parts[0]}, and {parts[1]}."
    found = {"kind": "trend", "experiment": kind, "lever": lever, "slope": slope}
    return found | {"p": p, "sentence": sentence}


def _offset(kind, rows, drawn):
    """All settings of an experiment off to one side."""
    r = np.array([row["standardised"] for row in rows])
    p = share_above(np.abs(drawn.sum(1)), abs(float(r.sum())))
    if p > P_TREND:
        return None
    where = f"over its {len(rows)} settings" if len(rows) > 1 else "at its one setting"
    sentence = f"The measured {QUANTITIES[kind].words} {_distance(rows)} {where}."
    found = {"kind": "offset", "experiment": kind, "lever": None, "slope": None}
    return found | {"p": p, "sentence": sentence}


def _setting(row):
    """One setting at odds with what the others say; an experiment without levers has one."""
    where = " and ".join(at_lever(lever, v) for lever, v in row["levers"].items())
    place = f" at {where} alone" if where else ""
    sentence = f"The measured {QUANTITIES[row['experiment']].words}{place} {_distance([row])}."
    found = {"kind": "setting", "experiment": row["experiment"], "lever": None, "slope": None}
    return found | {"p": row["predictive_p"], "sentence": sentence}


def _distance(rows):
    """Mean distance of the measured values from the model in words; agreement within one standard
    error."""
    if abs(np.mean([r["standardised"] for r in rows])) * np.sqrt(len(rows)) < 1.0:
        return "agrees with the model"
    share = np.mean([r["measured"] / r["predicted"] - 1.0 for r in rows])
    return f"{'exceeds' if share > 0 else 'falls short of'} the model by {100 * abs(share):.2g} %"


def moved(
    before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Parameters that the extended model still determines, outside the base calibration's interval.

    {name: {base, extended, shift_percent, shift_in_base_sd, sentence}}; the shift is how wrong the
    base had been."""
    out = {}
    for name, old in before.items():
        new = after[name]
        if not new["identified"] or old["low"] <= new["value"] <= old["high"]:
            continue
        shift = old["value"] - new["value"]
        percent = 100.0 * shift / new["value"]
        side = "too high" if shift > 0 else "too low"
        out[name] = {
            "base": old["value"],
            "extended": new["value"],
            "shift_percent": float(percent),
            "shift_in_base_sd": float(shift / old["sd"]),
            "sentence": f"The base calibration had {new['words']} at {old['value']:.3f} "
            f"in place of "
            f"{new['value']:.3f}: {abs(percent):.2g} % {side}, {abs(shift / old['sd']):.1f} of its "
            f"stated standard "
            "deviations.",
        }
    return out


def calibration(model: Model, fitted: Fit) -> dict[str, dict[str, Any]]:
    """A mapping for each parameter: mode, standard deviation, 95 % interval cut at the emulators'
    range, the share of the prior's sd that is left, and whether the data identify it (the data must
    halve the prior's sd)."""
    out = {}
    sd = np.sqrt(np.diag(fitted.cov[0]))
    for k, factor in enumerate(model.factors):
        mode = fitted.theta[0, k]
        left = float(sd[k] / model.prior_sd[k])
        ends = [
            float(np.clip(mode + z * sd[k], -WIDENED, WIDENED)) for z in (-NORMAL_95, NORMAL_95)
        ]
        out[factor.name] = {
            "value": float(factor.natural(float(mode))),
            "sd": float(sd[k] * factor.half_range),
            "low": float(factor.natural(ends[0])),
            "high": float(factor.natural(ends[1])),
            "prior_sd_left": left,
            "identified": left < 0.5,
            "at_bound": bool(abs(mode) > WIDENED - 0.01),
            "words": parameter_words(factor.key),
        }
    return out
