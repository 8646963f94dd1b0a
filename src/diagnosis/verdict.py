"""verdict.json: what the diagnosis found, in one documented mapping."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np

from calibration.figures import label
from diagnosis import discrepancy, shared_errors
from diagnosis.identify import carried, key_of, lack_of_fit
from diagnosis.next_measurement import propose
from diagnosis.page.words import capital, chance
from diagnosis.residuals import by_chance, calibration, moved, residual_rows, trends
from diagnosis.settings import BASE

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from diagnosis.catalogue import Mechanism
    from diagnosis.identify import Identification
    from diagnosis.model import Emulated


SCHEMA = Path(__file__).with_name("verdict.schema.json")
RIVALS = 4


def findings(
    emulated: Emulated, measurements: Sequence[Measurement], found: Identification
) -> dict[str, Any]:
    """The mapping without its gain, of an `Identification`."""
    base = found.fits[BASE]
    error = found.data.error[0]
    drawn = by_chance(measurements, error, base.sd[0])
    rows = residual_rows(measurements, base, drawn, error)
    patterns = trends(rows, drawn)
    out = {
        "verdict": found.verdict,
        # a place without a name has its names in `laws`
        "causes": [] if found.verdict == "discovered" else found.causes,
        "reason": found.reason,
        "lack_of_fit": lack_of_fit(base, found.lack_of_fit_p),
        "family_p": found.family_p,
        "tried": found.tried,
        "threshold_level": found.level,
        "null_threshold_best": found.threshold,
        "ranking": found.ranking,
        "set_up_errors": found.errors,
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
        out |= unexplained(rows, ranges)  # type: ignore[arg-type]  # `derived` fills it in
    winner = extended_name(found)
    likeliest = found.fits[winner or BASE]
    out["scatter"] = shared_errors.scatter(likeliest.shared_errors(found.data))
    out |= {"misfit": out["lack_of_fit"], "rows": [], "test": None}
    out["laws"] = laws_of(
        found, emulated.catalogue, list(dict.fromkeys(m.experiment for m in measurements))
    )
    out["errors"] = [
        {"experiment": s["experiment"], "of": s["of"], "what": "declared", "sd": s["sd"], "p": None,
         "rivals": []}
        for s in out["scatter"]
    ]  # fmt: skip
    if winner:
        out["calibration_extended"] = calibration(found.models[winner], found.fits[winner])
        out["moved"] = moved(out["calibration"], out["calibration_extended"])
    return out


def laws_of(
    found: Identification, catalogue: Mapping[str, Mechanism], kinds: Sequence[str]
) -> list[dict[str, Any]]:
    """[{experiment, slot, state, names, ...}] of the causes of an `Identification`: one for each
    cause that is named; of a place that is known one with all names; of an ambiguous one the best,
    the others being its rivals."""
    rows = [_place(catalogue[name], kinds) for cause in found.causes for name in cause.split(" + ")]
    if found.verdict == "discovered":
        most = max(rows, key=lambda r: len(r["state"]))
        return [most | {"names": found.causes, "sentence": _told(most["slot"], found)}]
    if found.verdict == "ambiguous" and rows:
        best = rows[0]
        same = [r for r in rows if (r["slot"], r["state"]) == (best["slot"], best["state"])]
        best["names"] = list(dict.fromkeys(n for r in same for n in r["names"]))
        best["rivals"] = [
            {k: r[k] for k in ("experiment", "slot", "state")} | {"words": r["names"][0]}
            for r in rows
            if r not in same
        ]
        rows = [best]
    return rows


def _place(mechanism, kinds):
    slot, state = mechanism.law or (mechanism.name, ())
    return {
        "experiment": next(k for k in mechanism.experiments if k in kinds),
        "slot": slot,
        "state": list(state),
        "names": [mechanism.name],
        "forms": [],
        "values": [],
        "unit": "1",
        "gain": None,
        "rivals": [],
        "sentence": "",
    }


WORDS = {"attraction": "grains attract each other"}
"""What acts in a slot, where its name does not say it."""


def _told(slot, found):
    """A sentence on a place: what acts there, the names that fit, and how often data without a law
    look so."""
    words = WORDS.get(slot, f"a law of the {label(slot)} is missing")
    names = " and ".join(label(n) for n in found.causes)
    return (
        f"{capital(words)}: {names} are about equally probable, and of data "
        f"without a law {chance(found.family_p)} look so."
    )


def unexplained(
    rows: Sequence[Mapping[str, Any]], ranges: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, Any]:
    """What stands in a verdict that explains nothing: the discrepancy over the levers, and the
    setting where it is least known."""
    asked = discrepancy.least_known(rows, ranges)
    return {"discrepancy": discrepancy.curves(rows)} | (
        {"next_measurement": asked} if asked else {}
    )


def extended_name(found: Identification) -> str | None:
    """Name of the model to extend to: the causes where identified, the best of them where
    ambiguous, else None."""
    if found.verdict == "identified":
        return (
            key_of(found.causes)
            if key_of(found.causes) in found.fits
            else found.ranking[0]["mechanism"]
        )
    return found.ranking[0]["mechanism"] if found.verdict in ("discovered", "ambiguous") else None


def _next(emulated, measurements, found):
    """The measurement that separates the rivals; the base model is one of them unless it has
    been refuted."""
    refuted = found.verdict in ("identified", "discovered", "ambiguous")
    names = [r["mechanism"] for r in found.ranking][:RIVALS] + ([] if refuted else [BASE])
    causes = [n for n in found.causes if n in found.fits]
    if found.verdict in ("discovered", "ambiguous") and len(causes) > 1:
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


def validate(verdict: Mapping[str, Any]) -> None:
    """Raise jsonschema.ValidationError where the mapping does not follow verdict.schema.json."""
    jsonschema.validate(verdict, json.loads(SCHEMA.read_text()))
