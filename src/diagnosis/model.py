"""The emulated model of a set of conditions, with or without mechanisms."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calibration.errors import CalibrationError
from calibration.study.factors import Factor
from diagnosis.catalogue import Mechanism
from diagnosis.design import WIDENED, factor_share, inputs_of
from diagnosis.emulator import scale_of
from diagnosis.settings import BASE, Settings, lever_values

STEP = 1e-3  # of a coded parameter, for derivatives
TINY = 1e-12  # in place of the distance of two bounds that are one


@dataclass
class Emulated:
    """What every diagnosis of one engine and configuration shares: emulators, settings, factors,
    catalogue."""

    emulators: Mapping[tuple[str, str], Any]
    settings: Settings
    factors: Sequence[Factor]
    catalogue: Mapping[str, Mechanism]
    failures: Mapping[tuple[str, str], Any] = field(default_factory=dict)

    def model(
        self,
        conditions: Sequence[tuple[str, dict]],
        mechanisms: Iterable[str] = (),
        tests: Sequence[tuple[str, dict]] = (),
    ) -> "Model":
        """`Model` of conditions [(experiment, levers)] with the named mechanisms switched on; of
        `tests`, conditions too, it tells how likely they end without a value."""
        return Model(self, conditions, [self.catalogue[m] for m in mechanisms], tests)

    def applicable(self, conditions: Sequence[tuple[str, dict]]) -> list[str]:
        """Mechanisms that have an emulator, or a law of measurement, for an experiment of the
        conditions."""
        kinds = {e for e, _ in conditions}
        return [
            m.name
            for m in self.catalogue.values()
            if any(
                e in kinds and (m.observe is not None or (e, m.name) in self.emulators)
                for e in m.experiments
            )
        ]


class Model:
    """Predictions at n conditions for p parameters: coded factors in [-1, 1], then coded strengths
    in [0, 1]."""

    def __init__(
        self,
        emulated: Emulated,
        conditions: Sequence[tuple[str, dict]],
        mechanisms: Sequence[Mechanism],
        tests: Sequence[tuple[str, dict]] = (),
    ) -> None:
        settings = emulated.settings
        self.conditions, self.mechanisms, self.tests = conditions, mechanisms, tests
        kinds = list(dict.fromkeys(e for e, _ in conditions))
        used = {p for e in kinds for p in settings.experiments[e].parameters}  # type: ignore[union-attr]  # `setup` fills it in
        self.factors = [f for f in emulated.factors if f.key in used]
        self.names = [f.name for f in self.factors] + [m.name for m in mechanisms]
        self.low = np.array([-WIDENED] * len(self.factors) + [0.0] * len(mechanisms))
        self.high = np.array([WIDENED] * len(self.factors) + [1.0] * len(mechanisms))
        self.prior_mean = np.array([0.0] * len(self.factors) + [0.5] * len(mechanisms))
        self.prior_sd = np.array([1.0] * len(self.factors) + [0.5] * len(mechanisms))
        self._parts = [_Part(emulated.emulators, settings, self, conditions, e) for e in kinds]
        self._failing = [
            _Part(emulated.failures, settings, self, tests, e)
            for e in dict.fromkeys(e for e, _ in tests)
        ]

    def predict(self, theta: np.ndarray, errors: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Values (b, n) in their units and, where `errors`, emulator errors (b, n) at theta (b,
        p)."""
        value, error = (np.zeros((len(theta), len(self.conditions))) for _ in range(2))
        for part in self._parts:
            value[:, part.rows], own = part.predict(theta, errors)
            if errors:
                error[:, part.rows] = own
        return value, error

    def slope(self, theta: np.ndarray) -> np.ndarray:
        """Derivatives (b, n, p) of the values by theta (b, p)."""
        return self._by_differences(lambda at: self.predict(at, errors=False)[0], theta)

    def _by_differences(self, told, theta):
        """Derivatives (b, n, p) of told(theta) (b, n), within the bounds: beyond them is nothing,
        and an effect may start there with any slope."""
        b, p = theta.shape
        ends = np.tile(theta, (p, 2, 1, 1))  # of each parameter, all asked for at once
        for k in range(p):
            ends[k, 0, :, k] = np.maximum(theta[:, k] - STEP, self.low[k])
            ends[k, 1, :, k] = np.minimum(theta[:, k] + STEP, self.high[k])
        values = told(ends.reshape(-1, p))
        low, high = np.moveaxis(values.reshape(p, 2, b, values.shape[1]), 1, 0)
        apart = np.maximum((ends[:, 1] - ends[:, 0]).max(-1), TINY)
        return np.moveaxis((high - low) / apart[..., None], 0, -1)

    def scatter(self, theta: np.ndarray) -> np.ndarray:
        """Standard deviations (n,) of single runs in the unit of the value, at theta (p,)."""
        out = np.empty(len(self.conditions))
        for part in self._parts:
            out[part.rows] = part.scatter(theta)
        return out

    def odds(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithms of the odds (b, c) that the tests end without a value, and their derivatives
        (b, c, p) by theta (b, p)."""
        return self._odds(theta), self._by_differences(self._odds, theta)

    def _odds(self, theta):
        out = np.empty((len(theta), len(self.tests)))
        for part in self._failing:
            out[:, part.rows] = part.transformed(theta, errors=False)[0]
        return out

    def error_correlation(self, theta: np.ndarray) -> np.ndarray:
        """Correlation (n, n) of the emulators' errors between the conditions, at theta (p,)."""
        out = np.zeros((len(self.conditions),) * 2)
        for part in self._parts:
            out[np.ix_(part.rows, part.rows)] = part.error_correlation(theta)
        return out


class _Part:
    """The conditions of one experiment, by what was trained: {(experiment, mechanism): ...}."""

    def __init__(self, trained, settings, model, conditions, experiment):
        self.scale, self.model = scale_of(experiment), model
        self.rows = [i for i, (e, _) in enumerate(conditions) if e == experiment]
        self.given = [conditions[i][1] for i in self.rows]
        values = [lever_values(settings, experiment, g) for g in self.given]
        ranges = settings.experiments[experiment].levers
        self.levers = {n: np.array([v[n] for v in values], float) for n in ranges}
        share = [np.log(self.levers[n] / lo) / math.log(hi / lo) for n, (lo, hi) in ranges.items()]
        self.share = np.column_stack(share)
        names = inputs_of(settings, model.factors, experiment, BASE)
        self.columns = [model.names.index(n) for n in names if n not in ranges]
        if (experiment, BASE) not in trained:
            raise CalibrationError(
                f"{experiment}: there is no emulator of the base model: more than half of its runs "
                "gave no value, or the emulators are of other measurements"
            )
        self.base = trained[experiment, BASE]
        self.laws, self.readings = [], []
        for k, m in enumerate(model.mechanisms, len(model.factors)):
            if experiment not in m.experiments:
                continue
            if m.observe is not None:
                self.readings.append((k, m))
            elif (experiment, m.name) in trained:
                self.laws.append((k, trained[experiment, m.name]))

    def predict(self, theta, errors):
        """Values (b, n) of this experiment, their errors (b, n) where `errors`."""
        z, variance = self.transformed(theta, errors)
        value, by_z = self.scale.inverse(z, self.levers)
        error = np.abs(by_z) * np.sqrt(variance) if errors else None
        for k, mechanism in self.readings:
            strength = mechanism.strength.natural(theta[:, k])
            for i, condition in enumerate(self.given):
                value[:, i] = mechanism.observe(value[:, i], condition, strength)
        return value, error

    def transformed(self, theta, errors):
        """Return what the emulators give (b, n), each law adding what it alone changes, and their
        variances (b, n), None without `errors`; one law alone needs no base."""
        x, alone = self._inputs(theta), 1 - len(self.laws)
        z, variance = np.zeros(len(x)), np.zeros(len(x)) if errors else None
        for k, law in [(None, self.base)] * (alone != 0) + self.laws:
            own = x if k is None else np.column_stack([x, np.repeat(theta[:, k], len(self.rows))])
            change, uncertain = law.predict(own, errors)
            z = z + (alone if k is None else 1) * change
            variance = variance + uncertain if errors else None
        shape = len(theta), len(self.rows)
        return z.reshape(shape), variance.reshape(shape) if errors else None

    def _inputs(self, theta):
        """Inputs (b n, d) of the base model's emulator at theta (b, p)."""
        own = np.repeat(factor_share(theta[:, self.columns]), len(self.rows), axis=0)
        return np.hstack([own, np.tile(self.share, (len(theta), 1))])

    def scatter(self, theta):
        """Standard deviations (n,) of single runs of the base model at theta (p,)."""
        z = self.transformed(theta[None], errors=False)[0]
        by_z = self.scale.inverse(z, self.levers)[1][0]
        return np.abs(by_z) * self.base.sd_of_run(self._inputs(theta[None]))

    def error_correlation(self, theta):
        """Correlation (n, n) of the errors at theta (p,): that of the base's emulator, or of the
        first law's."""
        x = self._inputs(theta[None])
        if not self.laws:
            return self.base.correlation(x)
        k, law = self.laws[0]
        return law.correlation(np.column_stack([x, np.full(len(x), theta[k])]))
