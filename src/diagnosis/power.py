"""Before anything is measured: how strong a law or a mechanism must be for a plan to show it.

The plan is a table of measurements whose values are guesses. Data are simulated from it with a law.
Halving finds the strength at which 80 % of the data make the family of terms alarm, as the first
step of a diagnosis does. The threshold of the alarm is that of data without a law. What was taken
for the law in these data is counted: it looks alike.
"""

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.statistics.ties import largest_first
from diagnosis.bulk import Bulk
from diagnosis.catalogue import Mechanism
from diagnosis.laws.readings import EXPONENT, readings_of
from diagnosis.laws.slots import added, scaled
from diagnosis.page.words import environment
from diagnosis.table_model.block import LAW, KnownCurves
from diagnosis.table_model.law import told_in, unit_of
from diagnosis.table_model.selection import SPENT, blocks_of, evidences

POWER = 0.8
REPLICATES = 99
OF_CHANCE = 399  # data without a law
LEAST_SHARE = 0.05  # of data in which something else is named, for it to be told
LADDER = np.geomspace(0.003, 0.8, 36)
"""Changes of the logarithm over half the range of the states that are tried."""


def power(
    measurements: Sequence[Measurement],
    known: KnownCurves | None = None,
    catalogue: Mapping[str, Mechanism] | None = None,
    alpha: float = 0.05,
    seed: int = 0,
    defaults: Mapping[str, Mapping[str, float]] | None = None,
) -> list[dict[str, Any]]:
    """[{experiment, law, slot, state, of, unit, detectable, share, right, taken_for}] of a plan.

    detectable: the weakest strength that POWER of data show, None where no strength tried is shown
    so often; share: of data that show it there, right: that name its slot and state, taken_for: the
    share that name another, {name: share}."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        readings = readings_of(measurements, kind, (defaults or {}).get(kind))
        if not readings.folds:
            continue
        # the values are guesses: they shall say nothing of errors
        readings = replace(readings, log=readings.centre)
        out += _rows([*blocks_of([readings], known).values()], catalogue or {}, alpha, seed)
    return out


def of_bulk(bulk: Bulk, alpha: float = 0.05, seed: int = 0) -> list[dict[str, Any]]:
    """The same of a plan of simulated tests, by the emulators. A plan's guesses need not fit one
    another: what counts is the base model that fits them best."""
    told = bulk.at(bulk.fitted.predicted[0])
    return _rows([*told.block().values()], bulk.emulated.catalogue, alpha, seed)


def _rows(blocks, catalogue, alpha, seed):
    """A row of each effect of blocks."""
    return [
        row | _detect(bench, curves, told, right)
        for block, bench in ((b, _Bench(b, alpha * SPENT[0], seed)) for b in blocks)
        for row, curves, told, right in _effects(block, catalogue)
    ]


class _Bench:
    """Draws data of a plan with an effect in them and lets the family judge them."""

    def __init__(self, block, alpha, seed):
        rng = np.random.default_rng([seed, 7])
        bare = np.array([not c for c in block.sds], float)
        self.block = block
        self._noise = block.noise(np.full(REPLICATES, int(bare.argmax())), rng)
        made = block.draw(OF_CHANCE, rng, bare)
        best = np.max(list(evidences(block, made).values()), axis=0)
        self._threshold = float(np.quantile(best, 1.0 - alpha))

    def shown(self, curve):
        """(share of data with a curve (n,) that alarm, keys (a,) of what leads in those)."""
        made = self.block.y + curve + self._noise
        values = evidences(self.block, made)
        table = np.array(list(values.values()))
        names = np.array(list(values))[table.argmax(0)]
        alarm = table.max(0) > self._threshold
        return float(alarm.mean()), names[alarm]


def _effects(block, catalogue):
    """(row, curves, told, right) of every free law, a line over the logarithm of its state, and of
    every mechanism with curves: curves (k, n) that it adds to the logarithms at rising strengths,
    what each of these is called, and the places at which it counts as found."""
    readings = block.readings
    own = (readings.experiment,)

    def row(kinds, name, place, of, unit):
        slot, state = place
        where = {"experiment": " and ".join(kinds), "law": name, "slot": slot, "state": [*state]}
        return where | {"of": of, "unit": unit}

    for term in block.terms.values():
        law = term.law
        if term.kind == LAW and law and term.free:
            x, middle, _ = scaled(law, readings)
            ladder = (law.sign or 1) * LADDER
            if law.weight is None:
                power_of = EXPONENT[readings.experiment]
                curves, told = -power_of * LADDER[:, None] * x, np.expm1(-2.0 * LADDER)
                of, unit = "change over the plan's states", "share"
            else:
                weight = law.weight(readings)
                good = (ladder[:, None] * weight > -0.95).all(1)
                curves = added(law, ladder[good, None] * weight, readings)
                told = told_in(law, readings, np.exp([middle])) * ladder[good]
                of, unit = "what it adds in the middle of the plan", unit_of(law)
            yield row(own, term.key, term.place, of, unit), curves, told, {term.place, *law.same}
    for term in block.terms.values():
        for shape in (s for s in term.shapes if s.name in catalogue):
            strength = catalogue[shape.name].strength
            order = largest_first(-np.abs(shape.label - strength.weakest))
            told = np.array([strength.natural(c) for c in shape.label[order]])
            curves = shape.mean[order]
            if block.ground is None:
                curves = curves - curves.mean(1, keepdims=True)
            kinds = term.more.get("experiments", own)
            named = row(kinds, shape.name, term.place, strength.name, strength.unit)
            yield named, curves, told, {term.place}


def _detect(bench, curves, told, right):
    """The rest of the row of an effect: its strengths are halved until POWER of data show it."""
    shown = cache(lambda k: bench.shown(curves[k]))
    last = len(curves) - 1
    share, _ = shown(last)
    if share < POWER:
        return {"detectable": None, "share": share, "right": None, "taken_for": {}}
    least = bisect_left(range(last), True, key=lambda k: shown(k)[0] >= POWER)
    share, names = shown(least)
    # a term is taken for its place, or by its key where it is no law
    terms = bench.block.terms
    wrong = [n for n in names if (terms[n].place if terms[n].kind == LAW else n) not in right]
    taken = {n: v / len(names) for n, v in Counter(wrong).most_common()}
    return {
        "detectable": float(told[least]),
        "share": share,
        "right": 1.0 - len(wrong) / len(names),
        "taken_for": {n: v for n, v in taken.items() if v >= LEAST_SHARE},
    }


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows in Markdown."""
    return environment().get_template("power.md.j2").render(rows=rows, share=POWER)
