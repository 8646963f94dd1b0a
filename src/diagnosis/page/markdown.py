"""A verdict as a page of Markdown, for reading in two minutes: `diagnosis.md.j2` says what stands
where, `first_lines` how it begins."""

import re
from collections.abc import Mapping
from typing import Any

from calibration.figures import label
from calibration.intake.quantities import LEVERS, QUANTITIES
from diagnosis.page import words
from diagnosis.page.first_lines import first_lines, misfit

LEAST_GAIN = 0.05  # nats; a mechanism with less is told in one line


def page(verdict: Mapping[str, Any]) -> str:
    """The Markdown of a mapping of verdict.json."""
    ranking = verdict["ranking"]
    text = (
        words.environment()
        .get_template("diagnosis.md.j2")
        .render(
            v=verdict,
            first=first_lines(verdict),
            fit=misfit(verdict),
            laws=verdict.get("laws") or [],
            helpful=[r for r in ranking if r["gain"] >= LEAST_GAIN],
            idle=[label(r["mechanism"]) for r in ranking if r["gain"] < LEAST_GAIN],
            errors=_errors(verdict),
            curves=_curves(verdict),
            rough_before={
                (r["experiment"], r["mechanism"]): r["error"]
                for r in _first_wave(verdict.get("refinement"))
            },
            excluded=_excluded(verdict),
        )
    )
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _errors(verdict):
    """Sentences on errors beyond the stated spread, and on single rows."""
    rows = [r for k in ("errors", "rows") for r in verdict.get(k) or [] if r.get("sentence")]
    told = [
        " ".join(part["sentence"] for part in (row, row.get("set_anew")) if part) for row in rows
    ]
    if told:
        return told
    return [
        f"Errors {words.between(s['of'])} in the {words.quantity(s['experiment'])}: "
        f"{words.size(s)}."
        for s in verdict.get("scatter") or []
    ]


def _curves(verdict):
    """[{lever, words, unit, worst: (at, value, low, high) or None, head, rows}] of the discrepancy
    over the levers; worst: where it leaves its band most."""
    out = []
    for c in verdict.get("discrepancy") or ():
        own, lever = QUANTITIES[c["experiment"]], LEVERS[c["lever"]]
        unit = "share of the prediction" if c["unit"] == "share" else c["unit"]
        miss = f"{own.words}: measured less predicted [{unit}]"
        head = f"{lever.words} [{lever.unit or 1}]", miss
        rows = list(zip(*(c[k] for k in ("at", "value", "low", "high")), strict=True))
        off = [row for row in rows if row[2] > 0.0 or row[3] < 0.0]
        out.append({"lever": c["lever"], "words": own.words, "unit": c["unit"], "head": head,
                    "worst": max(off, key=lambda row: abs(row[1]), default=None),
                    "rows": rows[::2]})  # fmt: skip
    return out


def _first_wave(refinement):
    return refinement["waves"][0]["left"] if refinement and refinement["waves"] else []


def _excluded(verdict):
    """{rows: [(name, of, what is excluded)], open: names} of what the data exclude."""
    rows, unlimited = [], []
    for row in verdict.get("exclusion") or []:
        name = label(row["mechanism"]) if "mechanism" in row else words.place(row)
        sides = [
            f"{side} {words.amount(row[side], row['unit'])}"
            for side in ("below", "above")
            if row[side] is not None
        ]
        if sides:
            rows.append((name, row["of"], " and ".join(sides)))
        else:
            unlimited.append(name)
    return {"rows": rows, "open": unlimited}
