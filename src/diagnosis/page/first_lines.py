"""The first three sentences of a diagnosis: what is wrong, by how much and where; the cause; what
it costs or what to measure next."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calibration.intake.quantities import LEVERS, QUANTITIES
from diagnosis.page.cause import cause, lines_of, pointed, scattered
from diagnosis.page.following import following
from diagnosis.page.words import WITHOUT, chance, in_unit, quantity, sentence, setting


def first_lines(verdict: Mapping[str, Any]) -> list[str]:
    """[what is wrong, the cause, the cost or the next measurement], of a mapping of
    verdict.json."""
    lines = [_wrong(verdict), cause(verdict), following(verdict)]
    return [sentence(text) for text in lines if text]


def _wrong(verdict):
    """What is off, by how much and where."""
    rows, p = verdict["residuals"], _misfit(verdict)["p"]
    if verdict["verdict"] in WITHOUT:
        return (
            f"constant coefficients meet the {len(rows)} settings within their errors: {chance(p)} "
            "of data without any fault look as bad"
        )
    ended = _ended(verdict) or _scattered(verdict) or _rows(verdict)
    if ended:
        return ended
    worst = _worst(rows)
    found = [r.get("experiment") for k in ("laws", "errors", "rows") for r in verdict.get(k) or ()]
    kinds = dict.fromkeys(k for k in (worst, *found) if any(r["experiment"] == k for r in rows))
    return f"the calibrated model misses {', and '.join(_missed(k, rows) for k in kinds)}"


def _missed(kind, rows):
    """By how much an experiment is missed, and where most."""
    own = [r for r in rows if r["experiment"] == kind]
    words = f"the {quantity(kind)} by {_off(kind, own)}"
    lever, value, miss = _where(kind, own)
    if lever:
        side = "below" if miss > 0 else "above"
        words += (
            f", most at a {LEVERS[lever].words} of {value:.4g} {LEVERS[lever].unit}".rstrip()
            + f", where it is {_told(kind, abs(miss))} {side} the readings"
        )
    return words


def _ended(verdict):
    """Tests that ended without a value, where they are off by more than all readings."""
    failed = [o for o in verdict.get("outcomes") or [] if o["failed"]]
    fit = _misfit(verdict)
    if not failed or (fit.get("deviance") or 0.0) <= fit["chi_square"]:
        return None
    worst = min(failed, key=lambda o: o["before"])
    return (
        f"{worst['failed']} of {worst['tests']} tests of the {quantity(worst['experiment'])} at "
        f"{setting(worst['levers'])} ended without a value, where the calibrated model expects it "
        f"of {chance(worst['before'])}"
    )


def _scattered(verdict):
    """How large an error from setting to setting is, where nothing else explains the misfit."""
    told = [
        f"the {quantity(e['experiment'])} scatters from setting to setting by {100 * e['sd']:.2g} %"
        for e in scattered(verdict)
    ]
    return " and ".join(told) + ", more than its readings' own errors say" if told else None


def _rows(verdict):
    """What single rows read, where nothing else is wrong."""
    rows = [r for r in pointed(verdict) if r.get("expected") is not None and r.get("line")]
    if len(rows) == 1:
        [row] = rows
        kind, off = row["experiment"], abs(row["standard_deviations"])
        return (
            f"line {row['line']} reads a {quantity(kind)} of {in_unit(kind, row['value'], '.4g')} "
            f"where all others say {in_unit(kind, row['expected'], '.4g')} ({off:.0f} standard "
            f"deviations), at {setting(row['levers'])}"
        )
    off = [f"{abs(r['standard_deviations']):.0f}" for r in rows]
    ends = " to ".join(dict.fromkeys(sorted(off, key=float)[:: max(len(off) - 1, 1)]))
    return (
        f"{lines_of(rows)} contradict all others, by {ends} standard deviations" if rows else None
    )


def _misfit(verdict):
    return verdict.get("misfit") or verdict["lack_of_fit"]


def _worst(rows):
    """Experiment with the largest root mean square residual."""
    kinds = list(dict.fromkeys(r["experiment"] for r in rows))

    def size(kind):
        return np.mean([r["standardised"] ** 2 for r in rows if r["experiment"] == kind])

    return max(kinds, key=size)


def _misses(kind, rows):
    """Measured less predicted (n,), as a share of the prediction where the spread goes with it."""
    miss = np.array([r["measured"] - r["predicted"] for r in rows])
    if QUANTITIES[kind].relative:
        miss = miss / np.array([r["predicted"] for r in rows])
    return miss


def _told(kind, miss):
    return f"{100 * miss:.2g} %" if QUANTITIES[kind].relative else in_unit(kind, miss, ".2g")


def _off(kind, rows):
    size = float(np.sqrt(np.mean(_misses(kind, rows) ** 2)))
    return f"{_told(kind, size)} (root mean square of {len(rows)} settings)"


def _where(kind, rows):
    """(lever, value, mean miss) of the level that is missed by most standard errors, of the levers
    with several levels; (None, None, None) without one."""
    miss, best = _misses(kind, rows), (0.0, None, None, None)
    for lever in dict.fromkeys(name for r in rows for name in r["levers"] if name in LEVERS):
        levels = [r["levers"].get(lever) for r in rows]
        if len(set(levels)) < 2:
            continue
        for value in {v for v in levels if v is not None}:
            at = [i for i, v in enumerate(levels) if v == value]
            off = sum(rows[i]["standardised"] for i in at) / np.sqrt(len(at))
            if abs(off) > best[0]:
                best = abs(off), lever, value, float(miss[at].mean())
    return best[1:]
