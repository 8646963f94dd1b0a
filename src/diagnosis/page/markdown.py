"""A verdict as a page of Markdown, for reading in two minutes: `diagnosis.md.j2` says what stands
where. `first_lines.j2` has the words of its first three sentences: what is wrong, by how much and
where; the cause; what it costs or what to measure next.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from calibration.intake.quantities import QUANTITIES
from calibration.study.cost import duration
from diagnosis.catalogue import load_catalogue
from diagnosis.page.words import environment, plain, sentence
from diagnosis.settings import BASE
from diagnosis.setup import CORES


def first_lines(verdict: Mapping[str, Any]) -> list[str]:
    """[what is wrong, the cause, the cost or the next measurement], of a mapping of
    verdict.json."""
    lines = [said(part, verdict) for part in ("wrong", "cause", "following")]
    return [sentence(text) for text in lines if text]


def said(part: str, verdict: Mapping[str, Any]) -> str:
    """One of them, not a sentence yet: `wrong`, `cause` or `following`."""
    macros = environment().get_template("first_lines.j2", globals=FACTS).module
    return plain(getattr(macros, part)(verdict))


# --- what is wrong ------------------------------------------------------------------------------


def misfit(verdict: Mapping[str, Any]) -> Mapping[str, Any]:
    """The chi-square of constant coefficients, with its chance."""
    return verdict.get("misfit") or verdict["lack_of_fit"]


def _ended(verdict):
    """The tests that ended without a value, where they are off by more than all readings."""
    failed = [o for o in verdict.get("outcomes") or [] if o["failed"]]
    fit = misfit(verdict)
    if not failed or (fit.get("deviance") or 0.0) <= fit["chi_square"]:
        return None
    return min(failed, key=lambda o: o["before"])


def _found_errors(verdict, but=("declared", "settings")):
    """The errors that were found, without those that are `but`."""
    return [e for e in verdict.get("errors") or [] if e.get("what") not in but]


def _scattered(verdict):
    """The errors from setting to setting of a verdict that has found nothing else."""
    only = verdict["verdict"] == "error" and not verdict.get("rows")
    alone = only and not _found_errors(verdict)
    return _found_errors(verdict, ("declared",)) if alone else []


def _pointed(verdict):
    """The single rows of a verdict that has found nothing else."""
    only = verdict["verdict"] == "error" and not _found_errors(verdict)
    return (verdict.get("rows") or []) if only else []


def _missed(verdict):
    """[{experiment, settings, size, lever, value, miss}] of the experiment that is missed most and
    of those with a cause: the root mean square, and the level that is missed most."""
    rows = verdict["residuals"]
    kinds = dict.fromkeys(r["experiment"] for r in rows)
    of = {kind: [r for r in rows if r["experiment"] == kind] for kind in kinds}
    worst = max(of, key=lambda k: np.mean([r["standardised"] ** 2 for r in of[k]]))
    found = [r.get("experiment") for k in ("laws", "errors", "rows") for r in verdict.get(k) or ()]
    return [
        {"experiment": k, "settings": len(of[k]), "size": np.sqrt(np.mean(_misses(of[k]) ** 2))}
        | _where(of[k])
        for k in dict.fromkeys((worst, *found))
        if k in of
    ]


def _misses(rows):
    """Measured less predicted (n,) of an experiment, as a share of the reading where the spread
    goes with it."""
    miss = np.array([r["measured"] - r["predicted"] for r in rows])
    if QUANTITIES[rows[0]["experiment"]].relative:
        miss = miss / np.array([r["measured"] for r in rows])
    return miss


def _where(rows):
    """{lever, value, miss} of the level that is missed by most standard errors, of the levers with
    several levels; of None without one."""
    misses, most, found = _misses(rows), 0.0, (None, None, None)
    for lever in dict.fromkeys(name for r in rows for name in r["levers"]):
        levels = [r["levers"].get(lever) for r in rows]
        if len(set(levels)) < 2:
            continue
        for value in {v for v in levels if v is not None}:
            at = [i for i, v in enumerate(levels) if v == value]
            off = abs(sum(rows[i]["standardised"] for i in at) / np.sqrt(len(at)))
            if off > most:
                most, found = off, (lever, value, float(misses[at].mean()))
    return dict(zip(("lever", "value", "miss"), found, strict=True))


# --- the cause ----------------------------------------------------------------------------------


def _named(verdict):
    """[{name, law, strength}] of the named mechanisms; law, strength: where something says them."""
    own = {law["names"][0]: law for law in verdict.get("laws") or [] if len(law["names"]) == 1}
    ranked = [r.get("strength") or {} for r in verdict.get("ranking") or []]
    return [
        {"name": n, "law": own.get(n), "strength": next((r[n] for r in ranked if n in r), None)}
        for n in dict.fromkeys(n for c in verdict["causes"] for n in c.split(" + "))
    ]


def _description(name):
    """Return what a mechanism of the catalogue does; None for one of a study's own folder."""
    known = load_catalogue()
    return known[name].description if name in known else None


def _weighed(verdict):
    """Laws and errors that are held, by their evidence."""
    held = [r for r in verdict["laws"] if not r.get("instead_of")] + _found_errors(verdict)
    return sorted(held or verdict["laws"], key=lambda r: -r["evidence"])


def _rivals(row):
    """The rivals of a law or error that are at another place."""
    same = [(s["slot"], tuple(s["state"])) for s in row.get("same") or ()]
    at = [(r.get("slot"), tuple(r.get("state") or ())) for r in row.get("rivals") or ()]
    return [r for r, where in zip(row.get("rivals") or (), at, strict=True) if where not in same]


# --- what to measure next -----------------------------------------------------------------------


def _zeros(verdict):
    """Return whether a wrong zero of the reading and one of its lever are in question alone."""
    rows = [r for k in ("laws", "errors") for r in verdict.get(k) or ()]
    first = max(rows, key=lambda r: r.get("evidence", 0.0), default={})
    near = _rivals(first)
    return bool(near) and all(
        r.get("what") == "zero" or (r.get("slot") == "reading" and not r["state"])
        for r in (first, *near)
    )


def _costliest(experiments):
    """The experiment whose miss falls most, of {experiment: {before, after}}."""
    return max(
        experiments, key=lambda k: experiments[k]["before"] / max(experiments[k]["after"], 1e-12)
    )


def page(verdict: Mapping[str, Any]) -> str:
    """The Markdown of a mapping of verdict.json."""
    text = environment().get_template("diagnosis.md.j2").render(
        v=verdict,
        first=first_lines(verdict),
        fit=misfit(verdict),
        laws=verdict.get("laws") or [],
        curves=_curves(verdict),
    )  # fmt: skip
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _curves(verdict):
    """[(curve of the discrepancy, its lowest and its highest level)] of those that leave their
    band, the farthest first; a level is {at, value, low, high}."""
    out = []
    for curve in verdict.get("discrepancy") or ():
        names = ("at", "value", "low", "high")
        rows = [dict(zip(names, r, strict=True)) for r in zip(*map(curve.get, names), strict=True)]
        far = max(abs(r["value"]) / max(r["high"] - r["low"], 1e-12) for r in rows)
        if any(r["low"] > 0.0 or r["high"] < 0.0 for r in rows):
            rows.sort(key=lambda r: r["value"])
            out.append((far, curve, rows[0], rows[-1]))
    return [row[1:] for row in sorted(out, key=lambda row: -row[0])]


FACTS = {
    f.__name__.lstrip("_"): f
    for f in (
        misfit, _found_errors, _ended, _scattered, _pointed, _missed, _named,
        _description, _weighed, _rivals, _zeros, _costliest, _curves,
    )
} | {
    "BASE": BASE, "CORES": CORES, "duration": duration,
}  # fmt: skip
"""What `first_lines.j2` asks of a verdict."""
