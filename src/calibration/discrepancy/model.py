"""The emulated model of a set of conditions, with or without mechanisms."""

import math

import numpy as np

from calibration.discrepancy.design import BASE, factor_share, inputs_of
from calibration.discrepancy.emulator import inverse
from calibration.discrepancy.settings import lever_values


class Emulated:
    """What every diagnosis of one engine and configuration shares: emulators, settings, factors, catalogue."""

    def __init__(self, emulators, settings, factors, catalogue):
        self.emulators, self.settings, self.factors = emulators, settings, factors
        self.catalogue = catalogue

    def model(self, conditions, mechanisms=()):
        """`Model` of conditions [(experiment, levers)] with the named mechanisms switched on."""
        return Model(self, conditions, [self.catalogue[m] for m in mechanisms])

    def applicable(self, conditions):
        """Mechanisms that have an emulator, or a law of measurement, for an experiment of the conditions."""
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
    """Predictions at n conditions for p parameters: coded factors in [-1, 1], then coded strengths in [0, 1]."""

    def __init__(self, emulated, conditions, mechanisms):
        settings = emulated.settings
        self.conditions, self.mechanisms = conditions, mechanisms
        kinds = list(dict.fromkeys(e for e, _ in conditions))
        used = {p for e in kinds for p in settings.experiments[e].parameters}
        self.factors = [f for f in emulated.factors if f.name in used]
        self.names = [f.name for f in self.factors] + [m.name for m in mechanisms]
        self.low = np.array([-1.15] * len(self.factors) + [0.0] * len(mechanisms))
        self.high = np.array([1.15] * len(self.factors) + [1.0] * len(mechanisms))
        self.prior_mean = np.array([0.0] * len(self.factors) + [0.5] * len(mechanisms))
        self.prior_sd = np.array([1.0] * len(self.factors) + [0.5] * len(mechanisms))
        self._parts = [_Part(emulated, self, e) for e in kinds]

    def predict(self, theta):
        """Values (b, n) in their units and emulator errors (b, n) at theta (b, p)."""
        shape = (len(theta), len(self.conditions))
        value, error = np.empty(shape), np.empty(shape)
        for part in self._parts:
            value[:, part.rows], error[:, part.rows] = part.predict(theta)
        return value, error


class _Part:
    """The conditions of one experiment."""

    def __init__(self, emulated, model, experiment):
        self.experiment, self.model = experiment, model
        self.rows = [i for i, (e, _) in enumerate(model.conditions) if e == experiment]
        self.given = [model.conditions[i][1] for i in self.rows]
        settings = emulated.settings
        values = [lever_values(settings, experiment, g) for g in self.given]
        ranges = settings.experiments[experiment].levers
        self.levers = {n: np.array([v[n] for v in values], float) for n in ranges}
        share = [np.log(self.levers[n] / lo) / math.log(hi / lo) for n, (lo, hi) in ranges.items()]
        self.share = np.column_stack(share)
        names = inputs_of(settings, model.factors, experiment, BASE)
        self.columns = [model.names.index(n) for n in names if n not in ranges]
        self.base = emulated.emulators[experiment, BASE]
        self.laws, self.readings = [], []
        for k, m in enumerate(model.mechanisms, len(model.factors)):
            if experiment not in m.experiments:
                continue
            if m.observe is not None:
                self.readings.append((k, m))
            elif (experiment, m.name) in emulated.emulators:
                self.laws.append((k, emulated.emulators[experiment, m.name]))

    def predict(self, theta):
        b, n = len(theta), len(self.rows)
        own = np.repeat(factor_share(theta[:, self.columns]), n, axis=0)
        x = np.hstack([own, np.tile(self.share, (b, 1))])
        # several laws act by the sum of what each changes; one alone needs no base
        z = np.zeros(b * n) if len(self.laws) == 1 else (1 - len(self.laws)) * self.base(x)
        variance = self.base.error**2 if len(self.laws) != 1 else 0.0
        for k, law in self.laws:
            z = z + law(np.column_stack([x, np.repeat(theta[:, k], n)]))
            variance += law.error**2
        value, slope = inverse(self.experiment, z.reshape(b, n), self.levers)
        error = np.abs(slope) * math.sqrt(variance)
        for k, m in self.readings:
            strength = m.strength.natural(theta[:, k])
            for i, condition in enumerate(self.given):
                value[:, i] = m.observe(value[:, i], condition, strength)
        return value, error
