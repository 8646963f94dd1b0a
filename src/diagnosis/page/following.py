"""The third sentence of a diagnosis: what the cause costs, or what to do next."""

from collections.abc import Mapping
from typing import Any

from calibration.figures import label
from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.study.cost import duration
from diagnosis.derived import CORES
from diagnosis.page.cause import lines_of, pointed, scattered
from diagnosis.page.words import WITHOUT, amount, capital, chance, in_unit, quantity, setting
from diagnosis.settings import BASE

MOST_TOLD = 2
OPEN = ("adequate", "ambiguous", "discovered", "unexplained")
"""Verdicts that more readings may change."""

HINT = 0.2
"""Chance of the misfit, or of the best mechanism's gain, from which on an adequate table of
emulated experiments says nothing of that mechanism."""


def following(verdict: Mapping[str, Any]) -> str | None:
    """The cost by the engine's own runs, the measurement that tells most, or what the data
    exclude and what keeps them from excluding more."""
    if verdict["verdict"] in WITHOUT:
        return _joined(f(verdict) for f in (_excluded, _hinted, _at_an_end, _what_decides))
    told = _untried(verdict), _cost(verdict) or _next(verdict), _what_decides(verdict)
    return _joined(told)


def _joined(texts):
    """Texts one after the other as sentences, those that are none left out; None without any."""
    told = [text for text in texts if text]
    return ". ".join([*told[:1], *map(capital, told[1:])]) or None


def _untried(verdict):
    """The mechanisms whose runs all ended as the tests did."""
    rows = verdict.get("untried") or ()
    told = [f"{label(r['mechanism'])} (in all of its {r['runs']} runs)" for r in rows]
    return told and (
        f"the tests ended as the simulations do with {' and '.join(told)}, which could be tried at "
        "no strength that gives a value and is not ruled out"
    )


def _cost(verdict):
    """What the cause costs, by the engine's own runs."""
    gain = verdict.get("gain")
    if not gain or verdict["verdict"] == "unexplained":
        return None
    before, after = gain["held_out_rmse_before"], gain["held_out_rmse_after"]
    if after < before:
        text = (
            f"without it the engine misses settings that were left out by {before:.1f} standard "
            f"errors, with it by {after:.1f}"
        )
        own = gain["by_experiment"]
        kind = max(own, key=lambda k: own[k]["before"] / max(own[k]["after"], 1e-12))
        before, after = own[kind]["before"], in_unit(kind, own[kind]["after"], ".3g")
        text += f" ({quantity(kind)}: {before:.3g} and {after})"
    else:
        text = (
            f"it says nothing beyond the levels that were measured: left out in turn, they are "
            f"missed by {after:.1f} standard errors with it and by {before:.1f} without"
        )
    more = _next(verdict) if verdict["verdict"] in ("ambiguous", "discovered") else None
    return _joined((text, more))


def _next(verdict):
    """The measurement that tells most."""
    if scattered(verdict):
        return "measure some settings again, each set up anew: if they differ, it is the set-up"
    rows = pointed(verdict)
    if rows:
        where = lines_of(rows) if all(r.get("line") for r in rows) else "the same setting"
        return f"measure next {where} again, and correct or remove what is wrong"
    if verdict["verdict"] == "ambiguous" and _row_or_law(verdict):
        where = lines_of(verdict["rows"])
        return f"measure next {where} again: a slip does not come out again, a law does"
    if _zeros(verdict):
        return (
            "no setting tells the zero of a reading from that of what was set: measure next a "
            "length that is known, with the same camera and scale"
        )
    n = verdict.get("next_measurement")
    if n and n.get("text"):
        return n["text"].rstrip(".")
    if n:
        return f"measure next the {quantity(n['experiment'])} at {setting(n['levers'])}{_told(n)}"
    errors = [
        e for e in verdict.get("errors") or [] if e.get("what") not in ("declared", "settings")
    ]
    return _again(errors[0]) if errors else None


def _row_or_law(verdict):
    """Whether a law is not told from a row with a line that is at odds with the others."""
    rivals = [r for law in verdict.get("laws") or () for r in law.get("rivals") or ()]
    return bool(verdict.get("rows")) and any(r.get("line") for r in rivals)


def _told(n):
    """What the first two rivals expect at the setting."""
    expected = list((n.get("predictions") or {}).items())[:MOST_TOLD]
    if len(expected) < MOST_TOLD:
        return ""
    kind = n["experiment"]
    return ": " + " and ".join(
        f"{label(name)} expects {in_unit(kind, p['value'], '.3g')}" for name, p in expected
    )


def _zeros(verdict):
    """Whether a wrong zero of the reading and one of its lever are in question alone."""
    rows = [r for k in ("laws", "errors") for r in verdict.get(k) or ()]
    first = max(rows, key=lambda r: r.get("evidence", 0.0), default={})
    same = [(s["slot"], s["state"]) for s in first.get("same") or ()]
    near = [r for r in first.get("rivals") or () if (r.get("slot"), r.get("state")) not in same]
    return bool(near) and all(map(_is_zero, (first, *near)))


def _is_zero(row):
    return row.get("what") == "zero" or (row.get("slot") == "reading" and not row["state"])


def _again(error):
    """What shows whether an error of the set-up is one."""
    lever = LEVERS.get(error["of"])
    if error.get("what") == "one level":
        level = f"{error['level']:g} {lever.unit}"
        return f"set the {lever.words} of {level} up anew and measure next there"
    if error.get("what") == "levels" and error.get("offsets"):
        worst = max(error["offsets"], key=lambda k: abs(error["offsets"][k]))
        return (
            f"set the {lever.words} up anew at {worst} {lever.unit} and measure next there: an "
            "error of the set-up comes out anew, a law does not"
        )
    if error.get("what") == "zero":
        return f"check the zero of the {lever.words} with one that is known"
    if error["of"] == "order":
        return "measure next the first rows of the table again: what drifts does not repeat them"
    if error["of"] == "resolution":
        return f"read to less than {error['step']:g} {QUANTITIES[error['experiment']].unit}"
    return None


def _hinted(verdict):
    """The setting that would show best whether the mechanism acts that the table is met with
    better, where data without a law look so in less than HINT."""
    n, ranking = verdict.get("next_measurement"), verdict.get("ranking")
    if not (n and ranking and verdict.get("emulators")) or ranking[0]["gain"] <= 0.0:
        return None
    name, p = ranking[0]["mechanism"], min(verdict["lack_of_fit"]["p"], verdict["family_p"])
    expected, kind = n["predictions"], n["experiment"]
    if p >= HINT or not {name, "base"} <= set(expected):
        return None
    with_it, without = (in_unit(kind, expected[k]["value"], ".3g") for k in (name, "base"))
    return (
        f"with {label(name)} these settings are met better, and {chance(p)} of data without a law "
        f"look so: measure next the {quantity(kind)} at {setting(n['levers'])}, where {with_it} is "
        f"expected with it and {without} without"
    )


def _excluded(verdict):
    """How much the coefficients can change at most over the plan."""
    told = []
    for row in verdict.get("exclusion") or []:
        low, high = row.get("below"), row.get("above")
        if "slot" in row and low is not None and high is not None:
            ends = f"{amount(low, row['unit'])} to {amount(high, row['unit'])}"
            told.append(f"{label(row['slot'])} over {' and '.join(row['state'])} by {ends}")
    return f"over the plan these can still change (90 %): {'; '.join(told)}" if told else None


def _at_an_end(verdict):
    """The coefficients that would go beyond their ranges, as where another law has to be made up
    for."""
    if not verdict.get("emulators"):
        return None
    ends = [c["words"] for c in verdict["calibration"].values() if c.get("at_bound")]
    return ends and (
        f"at an end of its range stands {'; '.join(ends)}. A coefficient there may make up for a "
        "law that is missing: measure it apart, or widen its range"
    )


def _what_decides(verdict):
    """Whether more runs or other readings would tell more, of emulated experiments."""
    left = (verdict.get("refinement") or {}).get("left") or ()
    rough = [r for r in left if r["mechanism"] == BASE and not r["enough"]]
    if not left or (not rough and verdict["verdict"] not in OPEN):
        return None
    if not rough:
        return (
            "no number of runs would tell more: the simulations' own error is small beside the "
            "readings', and further readings decide"
        )
    made = {r["experiment"]: r["runs"] for r in verdict["emulators"] if r["mechanism"] == BASE}
    share, each = verdict["refinement"]["share"], verdict["refinement"].get("run_seconds") or {}
    told = []
    for r in rough:
        runs = made[r["experiment"]]
        more = runs * ((r["error"] / share) ** 2 - 1.0)
        seconds = each.get(r["experiment"])
        time = f", {duration(more * seconds / CORES)} of {CORES} cores," if seconds else ""
        told.append(
            f"{r['error']:.2g} times the readings' ({quantity(r['experiment'])}), and about "
            f"{_round(more)} runs of it more{time} would bring it to {share:g}"
        )
    return (
        f"a smaller effect stays hidden, and more runs (`diagnosis: minutes`) show it: the base "
        f"model's own error is {'; '.join(told)}"
    )


def _round(count):
    """A number of runs to two digits."""
    return f"{float(f'{count:.2g}'):,.0f}"
