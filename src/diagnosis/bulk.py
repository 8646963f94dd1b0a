"""Simulated tests as a table model: what the emulators say, linear about the base model's best
point.

A reading is the emulated value at the best point, moved by its slopes there times what coefficients
may still be; the emulators' covariance is one more error. What a mechanism adds at a strength is
the emulated value at the best point with it, less what the base model's slopes make of that point:
so its curve bends with the coefficients as the emulators do. Single contacts have a level in place
of all this, and everything else is the same (`diagnosis.table_model`).

Tests that end without a value are readings too, of the logarithm of their odds with half a test
added on either side (Anscombe 1956, Biometrika 43:461): error and expectation of that.
"""

import copy
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import expit
from scipy.stats import binom, truncnorm

from calibration.intake.measurements import Measurement
from diagnosis.catalogue import Mechanism
from diagnosis.chance import CLOSE
from diagnosis.emulator import outcomes_of
from diagnosis.fit import Fit, data_of, fit
from diagnosis.laws.readings import Readings, readings_of, shared_covariance, to_log
from diagnosis.model import Emulated, Model
from diagnosis.next_measurement import words_of
from diagnosis.settings import lever_values
from diagnosis.table_model.block import LAW, Block, Ground, Shape, Term
from diagnosis.table_model.found import Found, judge, placed
from diagnosis.table_model.selection import CHANCE, CLEAR, evidences
from diagnosis.table_model.terms import all_terms, smooth_terms

STRENGTHS = np.linspace(0.0, 1.0, 11)
"""Coded strengths at which a mechanism's curve is asked for."""

ONE_FORMULA = {"attraction", "load"}
"""Slots whose laws add the same to a whole yield locus."""

RANK = 4  # directions in which a mechanism's emulator may err beyond the base model's
UNSEEN = 1e-4  # of a logarithm: a mechanism that never adds more does not show in the table
LEAST_CURVE = 5  # levels of a lever along which readings may follow a curve
LEAST = 1e-9  # value of a reading whose logarithm is taken


class Bulk:
    """The model of a table of simulated tests. measurements: those with a value, and behind them
    what is `beside`, settings that weigh nothing (`readings.unread`); data: `Data` of them and of
    the tests without one; base, fitted: the base model and its fit; shared: {(experiment, batch or
    instrument): standard deviation of the logarithm} of errors that readings share; aside: rows of
    readings that were set aside."""

    def __init__(
        self,
        emulated: Emulated,
        tested: Sequence[Measurement],
        aside: Sequence[dict[str, Any]] = (),
        beside: Sequence[Measurement] = (),
    ) -> None:
        self.emulated, self.tested, self.aside = emulated, tested, aside
        self.measurements = [*(m for m in tested if not m.outcome), *beside]
        self.tests, failed, tests = outcomes_of(tested, emulated.failures)
        self.data = replace(data_of(self.measurements), failed=failed, tests=tests)
        self.conditions = [m.condition for m in self.measurements]
        self.kinds = list(dict.fromkeys(m.experiment for m in self.measurements))
        self._parts = self._of_kinds()
        self._fits: dict[tuple[str, ...], tuple[Model, Fit]] = {}
        self._block: Block | None = None
        self.base, self.fitted = self.fit(())
        self.shared = self._shared_errors()
        if self.shared:
            expected = np.maximum(self.fitted.predicted[0], LEAST)
            covariance = shared_covariance(self.measurements, expected, self.shared)
            self.data, self._fits = replace(self.data, shared=covariance), {}
            self.base, self.fitted = self.fit(())

    def fit(self, names: Iterable[str]) -> tuple[Model, Fit]:
        """The model with mechanisms, and its fit."""
        key = tuple(names)
        if key not in self._fits:
            model = self.emulated.model(self.conditions, key, self.tests)
            self._fits[key] = model, fit(model, self.data)
        return self._fits[key]

    def at(self, values: np.ndarray) -> "Bulk":
        """The same table with other values (n,) at the same best point of the base model."""
        other = copy.copy(self)
        other._block = None
        other.data = replace(self.data, value=values[None])
        rows = zip(self.measurements, values, strict=True)
        other.measurements = [replace(m, value=float(v)) for m, v in rows]
        other._parts = other._of_kinds()
        return other

    def block(self) -> dict[str, Block]:
        """{name: `Block`} of the table, its terms beside it."""
        if self._block is None:
            bare, expected = self._bare()
            found = [*self._laws(bare.readings, *expected), *_errors(bare.readings)]
            self._block = replace(bare, terms={t.key: t for t in found})
        return {self._block.readings.experiment: self._block}

    def _bare(self):
        """The `Block` without a term, and what `_logs` expects at the base model's best point."""
        logs, slope, error = self._logs(self.base, self.fitted.theta[0])
        off = self.fitted.theta[0] - self.base.prior_mean
        ground = Ground(logs - slope @ off, slope * spread_of(self.base), error)
        return Block(self._readings(), {}, {}, ground), (logs, slope, error)

    def _shared_errors(self):
        """What `shared` is, as the model of the table tells it without a term."""
        names = {(k, n): at for k, (own, at) in self._parts.items() for n in own.groups}
        if not names:
            return {}
        block, _ = self._bare()
        name = block.readings.name_of
        return {(k, n): float(block.sd_of(name(n, k))[at].max()) for (k, n), at in names.items()}

    def judged(self, alpha: float = 0.05, seed: int = 0, chance: Sequence[int] = CHANCE) -> Found:
        """`Found` of the table, no further setting proposed."""
        found = placed(self.block(), self.measurements, self.aside, alpha, seed, chance)
        _doubt_one_formula(found)
        return judge(found, lambda: _bends(found.selection.blocks))

    def _of_kinds(self):
        """{experiment: (its `Readings`, their places)}, one experiment after the other."""
        parts, start = {}, 0
        for kind in self.kinds:
            defaults = lever_values(self.emulated.settings, kind, {})
            given = {k: v for k, v in defaults.items() if v is not None}
            own = readings_of(self.measurements, kind, given)
            parts[kind] = own, start + np.arange(len(own.log))
            start += len(own.log)
        return parts

    def _readings(self):
        """Of all experiments, then of the tests without a value."""
        parts, (odds, error, tests) = self._parts, self._odds()
        n, more = len(self.measurements) + len(odds), np.ones(len(odds))
        behind = {
            "rows": -more.astype(int), "log": odds, "error": error, "own": error,
            "replicates": more, "values": tests, "relative": more,
        }  # fmt: skip
        together = {
            name: np.concatenate([*(getattr(own, name) for own, _ in parts.values()), last])
            for name, last in behind.items()
        }
        groups = {}
        for kind, (own, at) in parts.items():
            for name, code in own.groups.items():
                groups[f"{name} of {kind}"] = np.full(n, -1)
                groups[f"{name} of {kind}"][at] = code
        kind = self.kinds[0] if len(self.kinds) == 1 else "bulk"
        return Readings(kind, groups=groups, parts=parts, **together)

    def _odds(self):
        """Logarithms (c,) of the odds of the tests, their errors, and numbers of tests."""
        if self.data.failed is None:
            return (np.zeros(0),) * 3
        failed, tests = self.data.failed[0], self.data.tests
        some, none = failed + 0.5, tests - failed + 0.5
        return np.log(some / none), np.sqrt(1.0 / some + 1.0 / none), tests

    def _logs(self, model, theta):
        """Logarithms (n,) that a model expects at theta (p,), their derivatives (n, p), and the
        covariance (n, n) of the emulators' errors."""
        parts = self._parts
        order = np.concatenate([own.rows for own, _ in parts.values()])
        told = *model.predict(theta[None]), model.slope(theta[None])
        value, error, slope = (v[0][order] for v in told)
        logs, by_value = np.empty(len(value)), np.empty(len(value))
        for kind, (own, at) in parts.items():
            logs[at], by_value[at] = to_log(kind, np.maximum(value[at], LEAST), own.levers)
        sd = error * by_value
        alike = model.error_correlation(theta)[np.ix_(order, order)]
        odds, by_odds = self._expected_odds(model, theta)
        n, c = len(logs), len(odds)
        covariance = np.zeros((n + c, n + c))
        covariance[:n, :n] = alike * np.outer(sd, sd)
        slopes = np.vstack([slope * by_value[:, None], by_odds])
        return np.concatenate([logs, odds]), slopes, covariance

    def _expected_odds(self, model, theta):
        """Return what is expected (c,) of the logarithms of the odds, and the derivatives (c,
        p)."""
        if not len(model.tests):
            return np.zeros(0), np.zeros((0, len(theta)))
        odds, slope = (v[0] for v in model.odds(theta[None]))
        value, rise = np.empty(len(odds)), np.empty(len(odds))
        for i, n in enumerate(self.data.tests.astype(int)):
            failed = np.arange(n + 1)
            told = np.log((failed + 0.5) / (n - failed + 0.5))
            chance = binom.pmf(failed, n, expit(odds[i]))
            value[i] = told @ chance
            rise[i] = told @ (chance * (failed - n * expit(odds[i])))
        return value, rise[:, None] * slope

    def _laws(self, readings, logs, slope, error):
        """A term for each place of a law, the mechanisms and free laws there as its shapes."""
        places = {}
        known = [self.emulated.catalogue[n] for n in self.emulated.applicable(self.conditions)]
        for mechanism in known:
            curves, roots = self._curves(mechanism.name, logs, slope, error)
            if np.abs(curves).max() > UNSEEN:
                place = place_of(mechanism, known)
                places.setdefault(place, []).append((mechanism, curves, roots))
        for place, own in places.items():
            kinds = [k for k in readings.parts if any(k in m.experiments for m, _, _ in own)]
            shapes = tuple(
                Shape(m.name, STRENGTHS, roots, curves, -float(np.log(len(own))), m.changes is None)
                for m, curves, roots in own
            )
            slot, state = place
            key = f"{kinds[0]}:{slot}({', '.join(state)})"
            more = {"experiments": kinds, "settings": self._shown(kinds)}
            yield Term(kinds[0], LAW, key, shapes, place=place, more=more)

    def _shown(self, kinds):
        """Settings of experiments with a value, or of which no test gave one."""
        count = sum(m.experiment in kinds for m in self.measurements)
        if self.data.failed is None:
            return count
        none = np.flatnonzero(self.data.failed[0] == self.data.tests)
        return count + sum(self.tests[i][0] in kinds for i in none)

    def _curves(self, name, logs, slope, error):
        """Return what a mechanism adds at each strength (k, n), and the roots (k, n, r) of what is
        uncertain about it."""
        model, _ = self.fit((name,))
        p, start = len(self.base.factors), self.fitted.theta[0]
        curves, left = [], []
        for coded in STRENGTHS:
            held = copy.copy(model)  # at the strength of its one mechanism
            for bound in ("low", "high", "prior_mean"):
                setattr(held, bound, np.append(getattr(model, bound)[:-1], coded))
            theta = fit(held, self.data, (float(coded),)).theta[0]
            own, _, covariance = self._logs(held, theta)
            curves.append(own - logs - slope @ (theta[:p] - start))
            size, direction = np.linalg.eigh(covariance - error)
            left.append(direction[:, -RANK:] * np.sqrt(np.maximum(size[-RANK:], 0.0)))
        curves = np.array(curves)
        between = 0.5 * np.gradient(curves, axis=0)[..., None]
        return curves, np.concatenate([between, np.array(left)], axis=2)


def spread_of(model: Model) -> np.ndarray:
    """Standard deviations (p,) of the model's parameters beforehand, cut at their bounds."""
    ends = (model.low - model.prior_mean, model.high - model.prior_mean)
    low, high = (end / model.prior_sd for end in ends)
    out: np.ndarray = model.prior_sd * truncnorm.std(low, high)
    return out


def place_of(mechanism: Mechanism, known: Sequence[Mechanism]) -> tuple[str, tuple[str, ...]]:
    """(slot, state) of a law. Mechanisms of the catalogue that act in one slot are at one place
    where the state of one of them holds the others'."""
    if mechanism.law is None:
        return mechanism.name, ()
    slot, state = mechanism.law
    if mechanism.changes is None:
        near = [m.law[1] for m in known if m.law and m.changes is None and m.law[0] == slot]
        widest = max(near, key=len)
        state = widest if all(set(other) <= set(widest) for other in near) else state
    return slot, tuple(state)


def _doubt_one_formula(found):
    """Give an attraction and a load that was not counted each other as rivals: both add the same to
    a whole yield locus, and only other sizes or tests, clearly, part them."""
    for law in (row for row in found.laws if row["slot"] in ONE_FORMULA):
        block = found.block_of(law["key"])
        values = evidences(block.without(law["key"]), block.readings.log[None])
        for key, term in block.terms.items():
            if term.kind != LAW or term.place[0] not in ONE_FORMULA - {law["slot"]}:
                continue
            behind = float((values[law["key"]] - values[key])[0])
            if behind < CLEAR and not any(r.get("slot") == term.place[0] for r in law["rivals"]):
                slot, state = term.place
                row = {"experiment": term.experiment, "behind": behind, "words": words_of(term)}
                law["rivals"].append(row | {"slot": slot, "state": list(state)})


def _bends(blocks):
    """Return whether a smooth curve along a lever explains more than an error of each setting."""
    for block in blocks.values():
        for lever, term in smooth_terms(block):
            own, _ = block.readings.of(term.experiment)
            some = len(own.folds[lever]) >= LEAST_CURVE and (own.levers[lever] > 0.0).all()
            if some and block.evidence(term, block.readings.log[None])[0] > CLOSE:
                return True
    return False


def _errors(readings):
    """The terms of each experiment that are no laws, over all readings. A wrong zero of the load is
    a mechanism of the catalogue."""
    for own, at in readings.parts.values():
        for term in all_terms(own, ()):
            if term.kind != LAW and term.what != "zero":
                yield _spread(term, at, len(readings.log))


def _spread(term, at, n):
    """A term of the readings at places (k,) as one of n readings."""

    def over(own):
        out = np.zeros((len(own), n, *own.shape[2:]))
        out[:, at] = own
        return out

    means = [None if s.mean is None else over(s.mean) for s in term.shapes]
    both = zip(term.shapes, means, strict=True)
    shapes = tuple(replace(s, root=over(s.root), mean=mean) for s, mean in both)
    return replace(term, shapes=shapes, rows=tuple(int(at[i]) for i in term.rows))
