"""Before anything is measured: how strong a law or a mechanism must be for a plan to show it.

The plan is a table of measurements whose values are guesses. Data are simulated from it with a law.
Halving finds the strength at which 80 % of the data make the family of laws alarm. The threshold of
the alarm is that of data without a law. What was taken for the law in these data is counted: it
looks alike.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from diagnosis.laws.choose import trial
from diagnosis.laws.forms import LADDER
from diagnosis.laws.found import middle_of, told_in, unit_of
from diagnosis.laws.mixed import errors_at, evaluate, from_space, shares
from diagnosis.laws.readings import readings_of
from diagnosis.laws.slots import scaled

POWER = 0.8
REPLICATES = 99
OF_CHANCE = 399  # data without a law, of each size of the errors
LEAST_SHARE = 0.05  # of data in which something else is named, for it to be told
LEAST_PLACE = 1e-3  # probability below which a size of the errors adds nothing to chance


@dataclass(frozen=True)
class Effect:
    """Curves (k, n) of a law in its space at rising strengths, and what each strength is called."""

    name: str
    candidate: object
    curves: np.ndarray
    strengths: np.ndarray
    of: str
    unit: str
    same: tuple = ()


def power(measurements, known=(), catalogue=None, alpha=0.05, seed=0, defaults=None):
    """[{experiment, law, slot, state, of, unit, detectable, share, taken_for}] of a plan.

    detectable: the weakest strength that POWER of data show, None where no strength tried is shown
    so often; share: of data that show it there, right: that name its slot and state, taken_for: the
    share that name another, {name: share}."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        readings = readings_of(measurements, kind, (defaults or {}).get(kind))
        if not readings.folds:
            continue
        tried = trial(readings, known, 0, everything=True)
        bench = _Bench(tried, alpha, seed)
        for effect in _effects(tried, catalogue or {}):
            out.append({"experiment": kind} | _detect(bench, effect))
    return out


class _Bench:
    """Draws data of a plan with an effect in them and lets the family judge them.

    Chance is that of a diagnosis: data without a law, with errors as large as the data at hand say,
    and as uncertain. An effect along a lever is in part taken for an error that its levels share.
    """

    def __init__(self, tried, alpha, seed):
        self.tried, self.alpha, self.seed = tried, alpha, seed
        self._normal = np.random.default_rng([seed, 7]).standard_normal(
            (REPLICATES, len(tried.readings.log))
        )
        self._of_chance = {}

    def _best(self, log):
        """Gain (r,) of the best law over none, and its name (r,)."""
        t = self.tried
        nothing = evaluate(t.base, t.readings, t.nuisance, log, t.centre).score
        gains = {
            name: evaluate(c, t.readings, t.nuisance, log, t.centre).score - nothing
            for name, c in t.candidates.items()
        }
        table = np.array(list(gains.values()))
        return table.max(0), np.array(list(gains))[table.argmax(0)]

    def _chance(self, place):
        """Gains (OF_CHANCE,), in order, of data without a law whose errors are those of a place of
        the grid."""
        if place not in self._of_chance:
            t, rng = self.tried, np.random.default_rng([self.seed, 8, place])
            drawn = errors_at(np.full(OF_CHANCE, place), t.nuisance, t.readings, rng)
            self._of_chance[place] = np.sort(self._best(t.centre + drawn)[0])
        return self._of_chance[place]

    def _by_chance(self, best, log):
        """Share (r,) of data without a law that gain as much, as `share_above` counts it."""
        t = self.tried
        above = np.zeros(len(best))
        for place, share in enumerate(shares(t.base, t.nuisance, log, t.centre)):
            if share.max() > LEAST_PLACE:
                below = np.searchsorted(self._chance(place), best)
                above += share * (1.0 - below / OF_CHANCE)
        return (1.0 + OF_CHANCE * above) / (1.0 + OF_CHANCE)

    def shown(self, effect, k):
        """(share of data that alarm, names (a,) of what leads in those)."""
        smooth = from_space(effect.candidate.space, effect.curves[k], self.tried.centre)
        log = smooth + self._normal * self.tried.readings.error
        best, names = self._best(log)
        alarm = self._by_chance(best, log) < self.alpha
        return float(alarm.mean()), names[alarm]


def _effects(tried, catalogue):
    """`Effect` of every free law, a line over the logarithm of its state, and of every mechanism
    with curves."""
    readings = tried.readings
    for name, law in tried.laws.items():
        x = scaled(law, readings.levers)[0] if law.coordinate else np.zeros(len(readings.log))
        if law.weight is None:
            power_of = 2.0 if readings.experiment == "drop" else 1.0
            curves, told = -power_of * LADDER[:, None] * x, np.expm1(-2.0 * LADDER)
            of, unit = "change over the plan's states", "share"
        else:
            weight = law.weight(readings.levers, tried.centre)
            curves = (law.sign or 1) * LADDER[:, None] * weight
            amount = told_in(law, tried, middle_of(law, readings))
            told = np.array([amount(0, z) for z in (law.sign or 1) * LADDER])
            of, unit = "what it adds in the middle of the plan", unit_of(law, readings.experiment)
        curves, told = _possible(law.space, curves, told)
        yield Effect(name, tried.candidates[name], curves, told, of, unit, law.same)
    for name, candidate in tried.candidates.items():
        if candidate.catalogue:
            strength = catalogue[name].strength
            off = strength.coded(strength.low if strength.off is None else strength.off)
            order = np.argsort(np.abs(candidate.label - off))
            natural = np.array([strength.natural(c) for c in candidate.label[order]])
            curves = candidate.mean[order]
            curves = curves - curves.mean(1, keepdims=True)
            yield Effect(name, candidate, curves, natural, strength.name, strength.unit)


def _possible(space, curves, told):
    """Without strengths at which a reading would be negative."""
    good = (curves > -0.95).all(1) if space != "log" else np.ones(len(curves), bool)
    return curves[good], told[good]


def _detect(bench, effect):
    """Row of an effect: its strengths are halved until POWER of data show it."""
    c = effect.candidate
    row = {"law": effect.name, "slot": c.slot, "state": list(c.state)}
    row |= {"of": effect.of, "unit": effect.unit}
    low, high = 0, len(effect.curves) - 1
    share, names = bench.shown(effect, high)
    if share < POWER:
        nothing = {"detectable": None, "share": share, "right": None, "taken_for": {}}
        return row | nothing
    while low < high:
        middle = (low + high) // 2
        found = bench.shown(effect, middle)
        if found[0] >= POWER:
            high, (share, names) = middle, found
        else:
            low = middle + 1
    right = {(c.slot, c.state), *effect.same}
    family = bench.tried.candidates
    wrong = [n for n in names if (family[n].slot, family[n].state) not in right]
    taken = {n: v / len(names) for n, v in Counter(wrong).most_common()}
    return row | {
        "detectable": float(effect.strengths[high]),
        "share": share,
        "right": 1.0 - len(wrong) / len(names),
        "taken_for": {n: v for n, v in taken.items() if v >= LEAST_SHARE},
    }


def page(rows, better=()):
    """The rows in Markdown; better: rows of a plan at the same cost, told beside them."""
    beside = {(r["experiment"], r["law"]): r for r in better}
    lines = [
        "# What this plan would show",
        "",
        f"The weakest effect that {POWER:.0%} of measurements with this plan and these errors "
        "would show, at a false-alarm rate held over all laws together; errors between settings "
        "come on top of it.",
        "",
        "| experiment | law or mechanism | of | from | by the better plan from | named rightly "
        "| taken for |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        name = r["law"].split(":")[-1].replace("_", " ")
        other = beside.get((r["experiment"], r["law"]))
        more = _from(other) if other else ""
        lines.append(
            f"| {r['experiment']} | {name} | {r['of']} | {_from(r)} | {more} | {_right(r)} |"
        )
    return "\n".join(lines) + "\n"


def _from(row):
    value = row["detectable"]
    if value is None:
        return f"not shown: {row['share']:.0%} at its strongest"
    text = f"{100 * value:+.2g} %" if row["unit"] == "share" else f"{value:.3g} {row['unit']}"
    return text.removesuffix(" 1")


def _right(row):
    if row["right"] is None:
        return "|"
    taken = [f"{n.split(':')[-1].replace('_', ' ')} {v:.0%}" for n, v in row["taken_for"].items()]
    return f"{row['right']:.0%} | {', '.join(taken)}"
