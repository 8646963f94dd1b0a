"""Numbers and names of a verdict as words."""

import math
import re
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import numpy as np
import yaml

from calibration.engines import templates
from calibration.engines.templates import capital
from calibration.figures import label
from calibration.intake.quantities import LEVERS, QUANTITIES

WITHOUT = ("adequate", "not decided")
"""Verdicts that find nothing wrong."""

MOST_ODDS = 1000.0
"""Odds that are told: no data of a laboratory bear more, for a model is never right to one in a
thousand."""


def with_article(name: str) -> str:
    """'a size', 'an impact number'."""
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def sentence(text: str | None) -> str:
    """Text that begins large and ends with one full stop; nothing of nothing."""
    text = (text or "").strip()
    return f"{capital(text).rstrip('.')}." if text else ""


def plain(text: str) -> str:
    """Text in one line."""
    return re.sub(r"[ \n]+", " ", text).strip()


def bare(text: str) -> str:
    """A sentence as a part of another one."""
    text = text.strip().rstrip(".")
    return text[:1].lower() + text[1:]


def joined(texts: Iterable[str]) -> str:
    """Texts one after the other as sentences, those that are empty left out."""
    first, *more = [t for t in map(plain, texts) if t] or [""]
    return ". ".join([first, *map(capital, more)])


def odds(gain: float) -> str:
    """'400 to 1' for a gain in nats; two digits, and no more than `MOST_ODDS`."""
    if gain > math.log(MOST_ODDS):
        return f"more than {MOST_ODDS:,.0f} to 1"
    value = float(f"{math.exp(gain):.2g}")
    return f"{value:,.0f} to 1" if value >= 10.0 else f"{value:g} to 1"


def chance(p: float | None) -> str:
    """A probability in per cent, at least 0.1 %; nothing of None."""
    if p is None:
        return ""
    return "at most 0.1 %" if p <= 1e-3 else f"{float(f'{100 * p:.2g}'):g} %"


def amount(value: float, unit: str) -> str:
    """A number with its unit, a share in per cent."""
    return f"{100 * value:+.2g} %" if unit == "share" else f"{value:.3g} {unit}".removesuffix(" 1")


def lever_of(name: str) -> tuple[str, str]:
    """What a lever is called, and its unit; what was recorded beside a reading has none."""
    known = LEVERS.get(name)
    return (known.words, known.unit) if known else (label(name), "")


def setting(levers: Mapping[str, float | None]) -> str:
    """Levers with their values and units, those that are set."""
    known = [(*lever_of(k), v) for k, v in levers.items() if v is not None]
    return ", ".join(f"{name} {v:g} {unit}".rstrip() for name, unit, v in known)


def in_unit(experiment: str, value: float, form: str) -> str:
    """A value of what an experiment measures, with its unit."""
    own = QUANTITIES[experiment].unit
    return f"{value:{form}}°" if own == "deg" else f"{value:{form}} {own}".rstrip()


def at(lever: str, value: float) -> str:
    """The value of a lever, or of what was recorded beside a reading, as a place."""
    name, unit = lever_of(lever)
    return f"{with_article(name)} of {value:.4g} {unit}".rstrip()


def miss(experiment: str, value: float) -> str:
    """By how much a measurement is missed: in per cent where the spread goes with the value."""
    own = QUANTITIES[experiment].relative
    return f"{100 * value:.2g} %" if own else in_unit(experiment, value, ".2g")


def lines_of(rows: Iterable[Mapping[str, Any]]) -> str:
    """'line 5', 'lines 5, 8 and 12', or 'lines 5 to 8' of a setting with several readings."""
    lines = np.unique([n for r in rows for n in r.get("lines") or [r["line"]]])
    told: list[str] = []
    for run in np.split(lines, np.flatnonzero(np.diff(lines) > 1) + 1):
        told += [f"{run[0]} to {run[-1]}"] if len(run) > 2 else map(str, run)
    head = ", ".join(told[:-1])
    many = head or " to " in told[0]
    return f"line{'s' if many else ''} {head + ' and ' if head else ''}{told[-1]}"


def place(row: Mapping[str, Any]) -> str:
    """Slot and state of a law."""
    if row["slot"] == "reading" and not row["state"]:
        return "a wrong zero of the reading"
    states = " and ".join(map(label, row["state"]))
    return f"{label(row['slot'])} of {states}" if states else label(row["slot"])


def keys(data: Mapping[str, Any] | None) -> list[str]:
    """Keys of a run spec, each as a line of YAML."""
    flow = {"default_flow_style": True, "sort_keys": False, "width": math.inf}
    return [f"{k}: {yaml.safe_dump(v, **flow).strip()}" for k, v in (data or {}).items()]


FILTERS = {
    f.__name__: f
    for f in (
        amount, at, bare, chance, in_unit, joined, keys, label, lever_of, lines_of, miss, odds,
        place, plain, sentence, setting, with_article,
    )
} | {
    "largest": lambda numbers: max(numbers, key=lambda k: abs(numbers[k])),
    "two_digits": lambda value: f"{float(f'{value:.2g}'):,.0f}",
}  # fmt: skip


def told(template: str, **facts: Any) -> str:
    """A template of this folder in one line."""
    return plain(environment().get_template(template).render(facts))


@cache
def environment() -> Any:
    """Return what the templates of this folder are read in."""
    own = templates.environment("diagnosis.page", tuple(FILTERS.items()))
    own.globals |= {"LEVERS": LEVERS, "QUANTITIES": QUANTITIES, "WITHOUT": WITHOUT}
    return own
