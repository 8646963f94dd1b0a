"""Runs of the engine with the law that single contacts show, at levels left out of its choice as
well as of its fit.

The levels of a lever that the law depends on are left out in turn. Among the laws that the engine
can have, the catalogue's included, the best without that level is chosen and fitted anew. So is the
constant coefficient. Both are then run at the settings of that level.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibration.intake.quantities import Condition
from calibration.runs.simulated import named
from dem.errors import SpecError
from dem.spec import parse_spec
from diagnosis.laws.choose import trial
from diagnosis.laws.found import curve, free_of
from diagnosis.laws.in_engine import curve_of, keys, switched_on
from diagnosis.laws.known import (
    COEFFICIENT,
    NO_COEFFICIENT,
    contact_logs,
    observed_log,
    with_coefficient,
)
from diagnosis.laws.readings import IN_AIR, unknown
from diagnosis.laws.slots import FAMILY

SEED = 90_000
STEPS = 3  # of the search for a coefficient: a reading is nearly a power of it
LEAST_LEVELS = 3  # of a lever, to leave one out
MOST_SETTINGS = 12
"""Settings at most that are run with either model. A drop takes seconds, the more the higher it is,
and the gain tells no more from further ones."""


@dataclass(frozen=True)
class Switch:
    """A law to be run: apply(spec, coefficient) -> spec with both; start: coefficient that a search
    begins with, None where the law has none; reads: {mechanism: strength} of the reading."""

    apply: Callable
    start: float | None
    reads: dict


def some_of(levels, most=MOST_SETTINGS):
    """Of each level (settings) those to be run: at most so many in all, spread over the levels, and
    over the settings of a level in turn."""
    some = np.round(np.linspace(0, len(levels) - 1, min(most, len(levels)))).astype(int)
    each = max(most // len(levels), 1)
    out = []
    for k, index in enumerate(levels):
        count = min(each, len(index)) if k in some else 0
        at = (np.arange(count) * len(index) // max(count, 1) + k) % len(index)
        out.append(np.sort(np.asarray(index)[at]))
    return out


class Nested:
    """The runs of the law that was found in one experiment.

    found: `Found` that has a law, of the measurements; known: the catalogue's curves
    (`diagnosis.laws.known`) for the catalogue {name: Mechanism}."""

    def __init__(self, found, measurements, rig, known, catalogue):
        self._law, self._measurements = found.law, measurements
        self._named = found.verdict == "identified"
        self._tried = found.trials[found.law["experiment"]]
        self._rig, self._known, self._catalogue = rig, known, catalogue
        self._coefficient, self._low, self._high = COEFFICIENT[found.law["experiment"]]

    def plan(self):
        """Rows [{label, setting, run_ids, reads}], {run id: spec}, and the `engine` of
        verdict.json's law: None where the engine cannot have it.

        A single contact does not scatter from seed to seed, so each setting has one run."""
        law = next(self._best_first(self._tried))
        if not self._usable(law, self._tried):
            return [], {}, None
        lever, levels = self._levels()
        rows, specs, chosen = [], {}, Counter()
        for index, run in zip(levels, some_of(levels), strict=True):
            if not len(run):
                continue
            others = trial(unknown(self._tried.readings, index), self._known, replicates=0)
            usable = (n for n in self._best_first(others) if self._usable(n, others))
            best = next(usable, None)
            chosen[others.laws[best].words if best in others.laws else best or "none"] += 1
            for label, name in (("before", None), ("after", best)):
                switch = self._switch(name, others)
                value = self._level(switch, name, others, index)
                rows += [self._row(label, switch, value, i, specs) for i in run]
        done = {"left_out": lever, "levels": sum(chosen.values()), "chosen": dict(chosen)}
        done |= {"run": len(rows) // 2, "of": sum(map(len, levels))}
        free = self._tried.laws.get(law)
        return rows, specs, done | {"keys": keys(free, self._law["values"]) if free else None}

    def _levels(self):
        """Lever and [settings] to be left out together: the levels of one that the law depends on;
        single settings where no lever has enough."""
        readings, where = self._tried.readings, (self._law["slot"], tuple(self._law["state"]))
        own = [f for f in FAMILY if f.experiment == readings.experiment]
        needs = [n for f in own if (f.slot, f.state) == where for n in f.needs]
        for name in (*needs, *readings.folds):
            if len(readings.folds.get(name, ())) >= LEAST_LEVELS:
                return name, readings.folds[name]
        return None, [np.array([i]) for i in range(len(readings.log))]

    def _best_first(self, tried):
        """Names of the laws; a mechanism stands for the free law of its slot and state where the
        verdict does not name it."""
        for name in sorted(tried.gains, key=lambda n: -tried.gains[n]):
            free = None if self._named else free_of(tried, tried.candidates[name])
            yield free.name if free else name

    def _usable(self, name, tried):
        if name not in tried.laws:
            return True  # of the catalogue
        law = tried.laws[name]
        if curve_of(law) is None:
            return False
        switch, middle = switched_on(law, curve(law, tried)[0])
        m = self._measurements[tried.readings.rows[0]]
        try:
            parse_spec(switch(self._rig.spec(m.condition, SEED), middle))
        except SpecError:  # beside the laws that the study has
            return False
        return True

    def _switch(self, name, others):
        """`Switch` of a law fitted to the others; of the constant coefficient for None."""
        power = IN_AIR if others.readings.experiment == "drop" else 1.0
        start = float(np.exp(others.centre.mean() / power))
        if name in others.laws:
            law = others.laws[name]
            return Switch(*switched_on(law, curve(law, others)[0]), {})

        def constant(spec, coefficient):
            return with_coefficient(spec, self._coefficient, coefficient)

        if name is None:
            return Switch(constant, start, {})
        mechanism, fit = self._catalogue[name], others.fits[name]
        strength = float(mechanism.strength.natural(others.candidates[name].label[fit.curve[0]]))
        if mechanism.observe is not None:
            return Switch(constant, start, {name: strength})
        if name in NO_COEFFICIENT:
            return Switch(lambda spec, _: mechanism.apply(spec, strength), None, {})
        return Switch(lambda spec, c: mechanism.apply(constant(spec, c), strength), start, {})

    def _level(self, switch, name, others, index):
        """The coefficient with which the engine's contacts meet the mean of the other readings."""
        value = switch.start
        if value is None:
            return None
        fit = others.fits[name] if name else others.base_fit
        kept = np.setdiff1d(np.arange(len(others.readings.log)), index)
        noise = others.nuisance.covariance[fit.nuisance[0]][np.ix_(kept, kept)]
        weight = np.linalg.inv(noise).sum(0)
        readings = others.readings.without(index)
        power = IN_AIR if readings.experiment == "drop" else 1.0
        for _ in range(STEPS):
            log = self._read(switch, value, readings)
            miss = float(weight @ (readings.log - log) / weight.sum())
            if not np.isfinite(miss):
                break  # grains stick
            value = float(np.clip(value * np.exp(miss / power), self._low, self._high))
        return value

    def _read(self, switch, value, readings):
        """(n,) logarithms of what the engine's one contact reads with a law switched on."""

        def spec_of(experiment, levers):
            return self._rig.spec(Condition(experiment, levers), self._rig.settings.seed)

        log = contact_logs(lambda spec: switch.apply(spec, value), readings, spec_of)
        for name, strength in switch.reads.items():
            log = observed_log(self._catalogue[name], strength, log, readings)
        return log

    def _row(self, label, switch, value, place, specs):
        setting = int(self._tried.readings.rows[place])
        spec = self._rig.spec(self._measurements[setting].condition, SEED + setting)
        own = named([switch.apply(spec, value)])
        specs |= own
        return {"label": label, "setting": setting, "run_ids": list(own), "reads": switch.reads}
