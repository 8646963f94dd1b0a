"""verdict.json: what the diagnosis found, in one documented mapping."""

import json
from pathlib import Path

import jsonschema
import numpy as np

from diagnosis import discrepancy, shared
from diagnosis.identify import carried, key_of, lack_of_fit
from diagnosis.next_measurement import propose
from diagnosis.residuals import by_chance, calibration, moved, residual_rows, trends
from diagnosis.settings import BASE

SCHEMA = Path(__file__).with_name("verdict.schema.json")
CONTENDERS = 4


def findings(emulated, measurements, found):
    """The mapping without its gain, of an `Identification`."""
    base = found.fits[BASE]
    drawn = by_chance(measurements, found.data.error[0], base.sd[0])
    rows = residual_rows(measurements, base, drawn)
    patterns = trends(rows, drawn)
    out = {
        "verdict": found.verdict,
        "causes": found.causes,
        "reason": found.reason,
        "lack_of_fit": lack_of_fit(base, found.lack_of_fit_p),
        "family_p": found.family_p,
        "tried": found.tried,
        "threshold_level": found.level,
        "null_threshold_best": found.threshold,
        "ranking": found.ranking,
        "residuals": rows,
        "patterns": patterns,
        "calibration": calibration(found.models[BASE], base),
        "coefficients": {
            "asked": len(found.models[BASE].names),
            "carried": carried(found.models[BASE], base),
        },
        "gain": None,
        "next_measurement": _next(emulated, measurements, found),
    }
    if found.verdict == "unexplained":
        ranges = {k: e.levers for k, e in emulated.settings.experiments.items()}
        out |= unexplained(rows, ranges)
    winner = extended_name(found)
    likeliest = found.fits[winner or BASE]
    out["scatter"] = shared.scatter(likeliest.shared_errors(found.data))
    if winner:
        out["calibration_extended"] = calibration(found.models[winner], found.fits[winner])
        out["moved"] = moved(out["calibration"], out["calibration_extended"])
    return out


def unexplained(rows, ranges=None):
    """What stands in a verdict that explains nothing: the discrepancy over the levers, and the
    setting where it is least known."""
    asked = discrepancy.least_known(rows, ranges)
    return {"discrepancy": discrepancy.curves(rows)} | (
        {"next_measurement": asked} if asked else {}
    )


def extended_name(found):
    """Name of the model to extend to: the causes where identified, the best of them where
    ambiguous, else None."""
    if found.verdict == "identified":
        return (
            key_of(found.causes)
            if key_of(found.causes) in found.fits
            else found.ranking[0]["mechanism"]
        )
    return found.ranking[0]["mechanism"] if found.verdict == "ambiguous" else None


def _next(emulated, measurements, found):
    """The measurement that separates the contenders; the base model is one of them unless it has
    been refuted."""
    refuted = found.verdict in ("identified", "ambiguous")
    names = [r["mechanism"] for r in found.ranking][:CONTENDERS] + ([] if refuted else [BASE])
    causes = [n for n in found.causes if n in found.fits]
    if found.verdict == "ambiguous" and len(causes) > 1:
        names = causes
    score = np.array([float(found.fits[n].score[0]) for n in names])
    # equal weights among causes that count as not told apart
    weight = np.exp(np.clip(score - score.max(), -3.0, 0.0))
    split = {tuple(n.split(" + ")) if n != BASE else (): n for n in names}
    return propose(
        emulated,
        measurements,
        {k: found.fits[n] for k, n in split.items()},
        dict(zip(split, weight, strict=True)),
    )


def validate(verdict):
    """Raise jsonschema.ValidationError where the mapping does not follow verdict.schema.json."""
    jsonschema.validate(verdict, json.loads(SCHEMA.read_text()))
