"""Which form of a law, and which mechanisms of the catalogue, fit as well as the best one.

Each is put in the law's place beside the other terms. It is ruled out where its evidence is less
than that of the best by the odds of 20 to 1 (`selection.ODDS`).
"""

from dataclasses import dataclass

import numpy as np

from diagnosis.laws.forms import text_of
from diagnosis.laws.readings import IN_AIR
from diagnosis.laws.slots import coordinates, scaled
from diagnosis.table_model.block import Block
from diagnosis.table_model.log_sum import log_sum
from diagnosis.table_model.selection import ODDS
from diagnosis.table_model.term import Term
from diagnosis.table_model.terms.laws import FREE

SAME = 0.5
"""Standard errors of a reading; curves that stay closer are one."""

UNIT = {
    "speed": "m/s",
    "size": "mm",
    "rate": "°/s",
    "load": "kPa",
    "interval": "s",
    "size over root of load": "mm/kPa^(1/2)",
}
"""Units of states; others are numbers."""


@dataclass(frozen=True)
class Named:
    """names: mechanisms that fit as well as the best form; forms: forms that do and are another
    curve, the best first; formulas: {form: text}; curves: {name: what it adds (n,)}; nearest: the
    likeliest mechanism, or None; coded: {mechanism: its coded strength}; likeliest: of all."""

    names: list
    forms: list
    formulas: dict
    curves: dict
    nearest: str | None
    coded: dict
    likeliest: str = ""

    @property
    def single(self) -> str | None:
        """The one mechanism that is left, or None. A form that fits as well is a formula and no
        other cause."""
        return self.names[0] if len(self.names) == 1 else None


def named(block: Block, key: str) -> Named:
    """`Named` of a law that is held in a block."""
    rest, term, y = block.without(key), block.terms[key], block.readings.log
    base = rest.base(y[None])
    evidence, held = {}, {}
    for shape in term.shapes:
        value = float(log_sum(rest.gains(shape, y[None], base)) - np.log(len(shape.label)))
        value -= float(log_sum(base))
        if value > evidence.get(shape.name, -np.inf):
            evidence[shape.name] = value
            own = Term(term.experiment, term.kind, key, (shape,), law=term.law, place=term.place)
            held[shape.name] = rest.holding(key, own)
    known = {s.name for s in term.shapes if s.catalogue}
    order = sorted(evidence, key=lambda n: -evidence[n])
    left = [n for n in order if evidence[order[0]] - evidence[n] < ODDS]
    curves = {n: held[n].part(key) for n in left}
    names = [n for n in left if n in known]
    forms = [n for n in left if n not in known and not any(
        _alike(curves[n], curves[k], block.readings.error) for k in names)]  # fmt: skip
    formulas = {n: written(held[n], key, n) for n in forms if n != FREE and term.law}
    nearest = next((n for n in order if n in known), None)
    # a free curve follows every form: it is told only where nothing else is left
    forms = [n for n in forms if n != FREE] if len(left) > 1 and left[0] != FREE else forms
    # of simulated tests a free law has a strength as well, of single contacts a mechanism alone
    strong = [n for n in names or order[:1] if n in known or term.law is None]
    coded = {n: held[n].strength(key) for n in strong}
    return Named(names, forms, formulas, curves, nearest, coded, order[0])


def _alike(one, other, error):
    apart = one - other
    return np.abs((apart - apart.mean()) / error).max() < SAME


def written(block: Block, key: str, name: str) -> str:
    """A named form with its coefficients, as fitted to the readings."""
    term, y = block.held[key].term, block.readings.log
    law, k = block.terms[key].law or term.law, block.strength(key)
    levers = coordinates(block.readings)
    _, middle, _ = scaled(law, levers) if law.coordinate else (None, 0.0, None)
    state = " x ".join(law.state)
    own = " ".join(UNIT.get(s, "") for s in law.state).strip()
    at = f"{np.exp(middle):.3g} {own}".rstrip()
    column = levers.get(state, np.ones(1))
    if (column <= 0.0).any():  # its coordinate is an exponential
        state = f"exp(({state} - {column.mean():.3g}) / {0.5 * np.ptp(column):.3g})"
    if law.weight:
        return name + (
            f" (at a {state} of {at}: {100 * k:+.3g} %)" if state else f": {100 * k:+.3g} %"
        )
    shape, _ = block.shape_of(key)
    number = int(np.argmin(np.abs(shape.label - k)))
    level = y - sum(block.part(o) for o in block.held if o != key) - shape.mean[number]
    weight = 1.0 / block.readings.error**2
    power = IN_AIR if law.experiment == "drop" else 1.0
    c = np.exp((level * weight).sum() / weight.sum() / power)
    text = text_of(name).format(c=f"{c:.3g}", k=k, s=state, m=at)
    return f"{name}: {law.slot} = {text}"
