"""The second sentence of a diagnosis: the cause in physical words."""

from collections.abc import Mapping
from typing import Any

from calibration.figures import label
from calibration.intake.quantities import LEVERS
from diagnosis.catalogue import load_catalogue
from diagnosis.page.words import amount, odds, place

MOST_RIVALS = 3
EVEN = 0.7
"""Log odds below which two are told as alike probable: 2 to 1."""


def cause(verdict: Mapping[str, Any]) -> str:
    """The cause, by the mapping of verdict.json."""
    said = verdict["verdict"]
    if said == "adequate":
        told = [e["sentence"] for e in verdict.get("errors") or [] if e.get("sentence")]
        if told:
            return f"no law and no single row is called for. {' '.join(told)}"
        return "no law, no error of the set-up and no single row is called for"
    if said == "not decided":
        return f"this does not decide that nothing is missing: {verdict['reason']}"
    if said == "unexplained":
        best = verdict.get("best_tried")
        names = " and ".join(label(c) for c in best or ())
        tried = f"; the best of those tried, {names}, does not fit" if best else ""
        return f"nothing that was tried explains it{tried}"
    if said == "error":
        return _error(verdict)
    if said == "identified":
        return f"the cause is {_identified(verdict)}"
    if said == "discovered":
        return _discovered(verdict)
    return _tied(verdict)


def scattered(verdict: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The errors from setting to setting of a verdict that has found nothing else."""
    errors = [e for e in verdict.get("errors") or [] if e.get("what") != "declared"]
    only = verdict["verdict"] == "error" and not verdict.get("rows")
    return errors if only and all(e.get("what") == "settings" for e in errors) else []


def pointed(verdict: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The single rows of a verdict that has found nothing else."""
    errors = [e for e in verdict.get("errors") or [] if e.get("what") != "declared"]
    return (verdict.get("rows") or []) if verdict["verdict"] == "error" and not errors else []


def lines_of(rows: list[Mapping[str, Any]]) -> str:
    """'line 5', or 'lines 5, 8 and 12'."""
    told = [str(r["line"]) for r in sorted(rows, key=lambda r: r["line"])]
    head = ", ".join(told[:-1])
    return f"lines {head} and {told[-1]}" if head else f"line {told[0]}"


def _error(verdict):
    if scattered(verdict):
        return "no law and no single row explains it: each setting has an error of its own"
    rows = pointed(verdict)
    if rows and all(r.get("line") for r in rows):
        like = [r["reads_like"] for r in rows if r.get("reads_like")]
        seems = "; they read like other levels" if len(like) > 1 else ""
        if len(rows) == 1 and like:
            seems = f"; it reads like one at {_level(like[0])}"
        return (
            f"a slip of reading or label in {lines_of(rows)}{seems}: no law and no error of the "
            "set-up explains it as well"
        )
    told = [r["sentence"] for r in (*(verdict.get("errors") or []), *rows) if r.get("sentence")]
    return told[0] if told else verdict["reason"]


def _level(like):
    lever = LEVERS[like["lever"]]
    return f"a {lever.words} of {like['value']:g} {lever.unit}"


def _identified(verdict):
    own = {law["names"][0]: law for law in verdict.get("laws") or [] if len(law["names"]) == 1}
    names = list(dict.fromkeys(n for c in verdict["causes"] for n in c.split(" + ")))
    return "; and ".join(_described(n, own.get(n)) + _strength(verdict, n) for n in names)


def _strength(verdict, name):
    """How strong a named mechanism is, with its 95 % interval; nothing where no fit says it."""
    rows = [r.get("strength") or {} for r in verdict.get("ranking") or []]
    found = next((r[name] for r in rows if name in r), None)
    if found is None:
        return ""
    value, ends = (
        amount(found["value"], found["unit"]),
        f"{found['low']:.3g} to {found['high']:.3g}",
    )
    return f", {found['name']} {value} (95 %: {ends})"


def _described(name, law=None):
    """A name with what it does, from the catalogue; a mechanism of a study's own folder by its
    name. law: with the numbers of its curve."""
    known = load_catalogue()
    words = f"{label(name)} ({known[name].description})" if name in known else label(name)
    told = _bare(law["sentence"]) if law and law.get("sentence") else ""
    return f"{words}: {told}" if told else words


def _bare(text):
    """A sentence as a part of another one."""
    text = text.strip().rstrip(".")
    return text[:1].lower() + text[1:]


def _discovered(verdict):
    laws = verdict.get("laws") or [verdict.get("law") or {}]
    told = [_law(law) for law in laws if law]
    return "; and ".join(t for t in told if t) or verdict["reason"]


def _law(law):
    """A law by its one name or by what it does, with the names that are left."""
    names = law.get("names") or []
    if len(names) == 1:
        return _described(names[0], law)
    if not law.get("sentence"):
        return f"a law without a single name acts here: {place(law)}"
    text = _bare(law["sentence"])
    if "evidence" not in law:
        return text
    left = " or ".join(label(n) for n in names)
    return f"{text}, by {left}" if names else f"{text}; no mechanism of the catalogue does so"


def _tied(verdict):
    """What is likeliest, and what is not told from it, with its odds."""
    laws, errors = verdict.get("laws") or [], verdict.get("errors") or []
    if not any("evidence" in row for row in (*laws, *errors)):
        return _alike(verdict, laws)
    held = [r for r in laws if not r.get("instead_of")]
    held += [e for e in errors if e.get("what") not in ("declared", "settings")]
    held = sorted(held or laws, key=lambda r: -r["evidence"])
    return "; and ".join(_with_rivals(row) for row in held) or verdict["reason"]


def _with_rivals(row):
    likeliest = _law(row) if "slot" in row else _bare(row["sentence"])
    same = {(s["slot"], tuple(s["state"])) for s in row.get("same") or ()}
    near = [
        r
        for r in row.get("rivals") or ()
        if "words" in r and (r.get("slot"), tuple(r.get("state") or ())) not in same
    ]
    told = [f"{r['words']} ({_against(r['behind'])})" for r in near[:MOST_RIVALS]]
    if not told:
        return likeliest
    return f"most likely {likeliest}; not told from it: {', '.join(told)}"


def _against(behind):
    return f"{odds(behind)} against it" if behind > EVEN else "as likely"


def _alike(verdict, laws):
    """The same of emulated experiments, whose causes have no odds of their own."""
    names = [label(n) for n in verdict["causes"]]
    names += [place(law) for law in laws if not law["names"]]
    if len(names) < 2:
        names += [r["words"] for law in laws for r in law.get("rivals", []) if "words" in r][:3]
    names += [r["words"] for law in laws for r in law.get("rivals", []) if r.get("line")][:1]
    if not names:
        return verdict["reason"]
    return f"these data do not tell which it is: {' or '.join(dict.fromkeys(names))}"
