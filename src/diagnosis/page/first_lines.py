"""The first three sentences of a diagnosis: what is wrong, by how much and where; the cause; what
it costs or what to measure next."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calibration.figures import label
from calibration.intake.quantities import LEVERS, QUANTITIES
from diagnosis.catalogue import load_catalogue
from diagnosis.page.words import capital, chance, in_unit, place, quantity, sentence, setting

WITHOUT = ("adequate",)


def first_lines(verdict: Mapping[str, Any]) -> list[str]:
    """[what is wrong, the cause, the cost or the next measurement], of a mapping of
    verdict.json."""
    lines = [_wrong(verdict), _cause(verdict), _cost(verdict) or _next(verdict)]
    return [sentence(text) for text in lines if text]


def _wrong(verdict):
    """What is off, by how much and where."""
    rows, p = verdict["residuals"], _misfit(verdict)["p"]
    if verdict["verdict"] in WITHOUT:
        return (
            f"constant coefficients meet the {len(rows)} settings within their errors: {chance(p)} "
            "of data without any fault look as bad"
        )
    ended = _ended(verdict) or _scattered(verdict)
    if ended:
        return ended
    kind = _worst(rows)
    own = [r for r in rows if r["experiment"] == kind]
    words = f"the calibrated model misses the {quantity(kind)} by {_off(kind, own)}"
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
    errors = [e for e in verdict.get("errors") or [] if e.get("what") != "declared"]
    only = verdict["verdict"] == "error" and not verdict.get("rows")
    if not only or any(e.get("what") != "settings" for e in errors):
        return None
    told = [
        f"the {quantity(e['experiment'])} scatters from setting to setting by {100 * e['sd']:.2g} %"
        for e in errors
    ]
    return " and ".join(told) + ", more than its readings' own errors say" if told else None


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


def _cause(verdict):
    """The cause in physical words."""
    laws, errors = verdict.get("laws") or [], verdict.get("errors") or []
    said = verdict["verdict"]
    if said in WITHOUT:
        return "no law, no error of the set-up and no single row is called for"
    if said == "unexplained":
        best = verdict.get("best_tried")
        tried = f"; the best of those tried, {_names(best)}, does not fit" if best else ""
        return f"nothing that was tried explains it{tried}"
    if said == "error" and _scattered(verdict):
        return "no law and no single row explains it: each setting has an error of its own"
    if said == "error":
        rows = [*errors, *(verdict.get("rows") or [])]
        found = [row["sentence"] for row in rows if row.get("sentence")]
        return found[0] if found else verdict["reason"]
    if said == "identified":
        return f"the cause is {_described(verdict['causes'])}"
    if said == "discovered":
        rows = laws or [verdict.get("law") or {}]
        found = [law["sentence"] for law in rows if law.get("sentence")]
        named = f"a law without a single name acts here: {place(laws[0])}" if laws else None
        return found[0] if found else named or verdict["reason"]
    return _tied(verdict, laws, errors)


def _tied(verdict, laws, errors):
    """What is not told apart."""
    names = [label(n) for n in verdict["causes"]]
    names += [place(law) for law in laws if not law["names"]]
    of = {e["of"] for e in errors if e.get("rivals")}
    names += [f"an error of the {LEVERS[o].words if o in LEVERS else o}" for o in sorted(of)]
    names = list(dict.fromkeys(names))
    if len(names) < 2:
        names += [r["words"] for law in laws for r in law.get("rivals", []) if "words" in r][:3]
    if not names:
        return verdict["reason"]
    return f"these data do not tell which it is: {' or '.join(dict.fromkeys(names))}"


def _names(causes):
    return " and ".join(label(c) for c in causes)


def _described(causes):
    """Names with what each does, from the catalogue; a mechanism of a study's own folder by its
    name."""
    known = load_catalogue()
    told = []
    for name in (n for c in causes for n in c.split(" + ")):
        words = known[name].description if name in known else None
        told.append(f"{label(name)} ({words})" if words else label(name))
    return " and ".join(told)


def _cost(verdict):
    """What the cause costs, by the engine's own runs."""
    gain = verdict.get("gain")
    if not gain or verdict["verdict"] in (*WITHOUT, "unexplained"):
        return None
    before, after = gain["held_out_rmse_before"], gain["held_out_rmse_after"]
    text = (
        f"without it the engine misses settings that were left out by {before:.1f} standard "
        f"errors, with it by {after:.1f}"
    )
    own = gain["by_experiment"]
    kind = max(own, key=lambda k: own[k]["before"] / max(own[k]["after"], 1e-12))
    before, after = own[kind]["before"], in_unit(kind, own[kind]["after"], ".3g")
    text += f" ({quantity(kind)}: {before:.3g} and {after})"
    following = _next(verdict)
    return f"{text}. {capital(following)}" if following and _open(verdict) else text


def _open(verdict):
    return verdict["verdict"] in ("ambiguous", "discovered")


def _next(verdict):
    """The measurement that tells most."""
    n = verdict.get("next_measurement")
    if _scattered(verdict):
        return "measure some settings again, each set up anew: if they differ, it is the set-up"
    if not n or verdict["verdict"] in WITHOUT:
        return None
    return f"measure next the {quantity(n['experiment'])} at {setting(n['levers'])}"
