"""verdict.json: what the diagnosis found, in one documented mapping."""

import json
from pathlib import Path

import jsonschema
import numpy as np

from calibration.discrepancy.identify import BASE, key_of
from calibration.discrepancy.next_measurement import propose
from calibration.discrepancy.residuals import calibration, moved, residual_rows, trends

SCHEMA = Path(__file__).with_name("verdict.schema.json")
CONTENDERS = 4


def findings(emulated, measurements, found):
    """The mapping without its gain, of an `Identification`."""
    base = found.fits[BASE]
    rows = residual_rows(measurements, base)
    patterns = trends(rows)
    out = {
        "verdict": found.verdict,
        "causes": found.causes,
        "reason": found.reason,
        "lack_of_fit": {
            "chi_square": float(base.chi_square[0]),
            "freedom": float(base.freedom[0]),
            "p": found.lack_of_fit_p,
        },
        "family_p": found.family_p,
        "null_threshold_best": found.threshold,
        "ranking": found.ranking,
        "residuals": rows,
        "patterns": patterns,
        "calibration": calibration(found.models[BASE], base),
        "gain": None,
        "next_measurement": _next(emulated, measurements, found),
    }
    winner = extended_name(found)
    if winner:
        out["calibration_extended"] = calibration(found.models[winner], found.fits[winner])
        out["moved"] = moved(out["calibration"], out["calibration_extended"])
    return out


def extended_name(found):
    """Name of the model to extend to: the causes where identified, the best of them where ambiguous, else None."""
    if found.verdict == "identified":
        return (
            key_of(found.causes)
            if key_of(found.causes) in found.fits
            else found.ranking[0]["mechanism"]
        )
    return found.ranking[0]["mechanism"] if found.verdict == "ambiguous" else None


def _next(emulated, measurements, found):
    """The measurement that separates the contenders; the base model is one of them unless it has been refuted."""
    refuted = found.verdict in ("identified", "ambiguous")
    names = [r["mechanism"] for r in found.ranking][:CONTENDERS] + ([] if refuted else [BASE])
    if found.verdict == "ambiguous":
        names = [n for n in found.causes if n in found.fits] or names
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


def page(verdict):
    """The verdict in Markdown, for reading in two minutes."""
    lines = ["# Diagnosis", "", f"**Verdict: {verdict['verdict']}**" + _causes(verdict), ""]
    fit = verdict["lack_of_fit"]
    lines += [
        f"{verdict['reason'].capitalize()}. Lack of fit of the base model: chi-square "
        f"{fit['chi_square']:.1f} on {fit['freedom']:.1f} degrees of freedom, p = {fit['p']:.3g}; "
        f"best mechanism against the whole catalogue: p = {verdict['family_p']:.3g}.",
        "",
        "## What the calibrated model gets wrong",
        "",
        *([f"- {t['sentence']}" for t in verdict["patterns"]] or ["- No pattern along a lever."]),
        "",
        "## Mechanisms",
        "",
        "| mechanism | gain in held-out log density | null threshold | p | strength |",
        "|---|---|---|---|---|",
    ]
    for r in verdict["ranking"]:
        strength = "; ".join(
            f"{s['value']:.3g} {s['unit']} ({s['low']:.3g} to {s['high']:.3g})"
            for s in r.get("strength", {}).values()
        )
        cells = [f"{r[k]:.3g}" if k in r else "" for k in ("null_threshold", "p")]
        lines.append(
            f"| {r['mechanism']} | {r['gain']:.2f} | {cells[0]} | {cells[1]} | {strength} |"
        )
    lines += ["", "## Calibrated parameters of the base model", ""]
    lines += ["| parameter | value | 95 % interval | identified |", "|---|---|---|---|"]
    for name, c in verdict["calibration"].items():
        known = "yes" if c["identified"] else "no: the data leave the prior"
        lines.append(f"| {name} | {c['value']:.3f} | {c['low']:.3f} to {c['high']:.3f} | {known} |")
    return "\n".join([*lines, "", *_gain(verdict), *_further(verdict)]) + "\n"


def _causes(verdict):
    return f": {', '.join(verdict['causes'])}" if verdict["causes"] else ""


def _gain(verdict):
    g = verdict["gain"]
    if not g:
        return []
    low, high = g["held_out_rmse_difference_interval"]
    lines = [
        "## Gain of the extended model, with the real engine on left-out settings",
        "",
        f"Root mean square error in {g['rmse_unit']}: {g['held_out_rmse_before']:.2f} before, "
        f"{g['held_out_rmse_after']:.2f} after; difference {low:.2f} to {high:.2f} (95 %), {g['settings']} settings.",
        "",
    ]
    lines += [f"- {m['sentence']}" for m in verdict.get("moved", {}).values()]
    return [*lines, ""]


def _further(verdict):
    n = verdict["next_measurement"]
    if not n:
        return []
    levers = ", ".join(f"{k} = {v:g}" for k, v in n["levers"].items() if v is not None)
    lines = [
        "## The measurement that would tell most",
        "",
        f"{n['experiment']} at {levers}: {n['information_bits']:.2f} bits.",
        "",
    ]
    return lines + [
        f"- {name} expects {p['value']:.3g} ± {p['sd']:.2g}" for name, p in n["predictions"].items()
    ]


def validate(verdict):
    """Raise jsonschema.ValidationError where the mapping does not follow verdict.schema.json."""

    jsonschema.validate(verdict, json.loads(SCHEMA.read_text()))
