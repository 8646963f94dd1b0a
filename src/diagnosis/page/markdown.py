"""A verdict as a page of Markdown, for reading in two minutes: `diagnosis.md.j2` says what stands
where. `first_lines.j2` has the words of its first three sentences: what is wrong, by how much and
where; the cause; what it costs or what to measure next.
"""

import re
from collections import ChainMap
from collections.abc import Mapping
from typing import Any

import pandas as pd

from calibration.intake.quantities import QUANTITIES
from calibration.study.cost import duration
from diagnosis.catalogue import load_catalogue
from diagnosis.page.words import environment, plain, sentence
from diagnosis.settings import BASE
from diagnosis.setup import CORES


def page(verdict: Mapping[str, Any]) -> str:
    """The Markdown of a mapping of verdict.json."""
    template = environment().get_template("diagnosis.md.j2")
    text = template.render(v=verdict, first=first_lines(verdict), curves=_curves(verdict))
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


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


def _placed(verdict):
    """The errors that have a place: neither declared ones nor those from setting to setting."""
    return [e for e in verdict["errors"] if e["what"] not in ("declared", "settings")]


def _alone(verdict):
    """(errors from setting to setting, single rows), each of a verdict that has found nothing
    else."""
    if verdict["verdict"] != "error" or _placed(verdict):
        return [], []
    rows = verdict["rows"]
    return [e for e in verdict["errors"] if e["what"] == "settings" and not rows], rows


def _missed(verdict):
    """[{experiment, settings, size, lever, value, miss}] of the experiment that is missed most and
    of those with a cause: the root mean square, and the level that is missed most.

    A miss is measured less predicted, as a share of the reading where the spread goes with it."""
    rows = pd.DataFrame(verdict["residuals"])
    share = [QUANTITIES[kind].relative for kind in rows.experiment]
    rows["miss"] = (rows.measured - rows.predicted) / rows.measured.where(share, 1.0)
    of = dict(iter(rows.groupby("experiment", sort=False)))
    worst = max(of, key=lambda kind: (of[kind].standardised ** 2).mean())
    found = [r["experiment"] for key in ("laws", "errors", "rows") for r in verdict[key]]
    return [
        {"experiment": kind, "settings": len(of[kind]), "size": (of[kind].miss ** 2).mean() ** 0.5}
        | _where(of[kind])
        for kind in dict.fromkeys((worst, *found))
        if kind in of
    ]


def _where(rows):
    """{lever, value, miss} of the level that is missed by most standard errors, of the levers with
    several levels; of None without one."""
    levels = pd.DataFrame([*rows.levers], rows.index)
    each = [
        {"lever": lever, "value": value, "miss": own.miss.mean(),
         "errors": abs(own.standardised.sum()) / len(own) ** 0.5}
        for lever in levels.columns[levels.nunique(dropna=False) > 1]
        for value, own in rows.groupby(levels[lever])
    ]  # fmt: skip
    return max(each, key=lambda level: level["errors"], default={"lever": None})


# --- the cause ----------------------------------------------------------------------------------


def _named(verdict):
    """[{name, law, strength}] of the named mechanisms; law, strength: where something says them."""
    own = {law["names"][0]: law for law in verdict["laws"] if len(law["names"]) == 1}
    strength = ChainMap(*(r.get("strength") or {} for r in verdict["ranking"]))
    return [{"name": n, "law": own.get(n), "strength": strength.get(n)} for n in verdict["causes"]]


def _weighed(verdict):
    """Laws and errors that are held, by their evidence."""
    held = [law for law in verdict["laws"] if not law.get("instead_of")] + _placed(verdict)
    return sorted(held or verdict["laws"], key=lambda r: -r["evidence"])


def _rivals(row):
    """The rivals of a law or error that are at another place."""
    same = [(s["slot"], s["state"]) for s in row.get("same", ())]
    return [r for r in row["rivals"] if (r.get("slot"), r.get("state")) not in same]


# --- what to measure next -----------------------------------------------------------------------


def _zeros(verdict):
    """Return whether a wrong zero of the reading and one of its lever are in question alone."""
    rows = [*verdict["laws"], *verdict["errors"]]
    first = max(rows, key=lambda r: r.get("evidence", 0.0), default={"rivals": ()})
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


def _curves(verdict):
    """[(curve of the discrepancy, its lowest and its highest level)] of those that leave their
    band, the farthest first; a level is {at, value, low, high}."""
    out = []
    for curve in verdict.get("discrepancy", ()):
        levels = pd.DataFrame({key: curve[key] for key in ("at", "value", "low", "high")})
        if ((levels.low > 0.0) | (levels.high < 0.0)).any():
            far = (levels.value.abs() / (levels.high - levels.low).clip(1e-12)).max()
            levels = levels.sort_values("value", kind="stable").to_dict("records")
            out.append((far, curve, levels[0], levels[-1]))
    return [row[1:] for row in sorted(out, key=lambda row: -row[0])]


FACTS = {
    f.__name__.lstrip("_"): f
    for f in (_placed, _alone, _missed, _named, _weighed, _rivals, _zeros, _costliest, _curves)
} | {"BASE": BASE, "CORES": CORES, "duration": duration, "known": load_catalogue}
"""What `first_lines.j2` asks of a verdict."""
