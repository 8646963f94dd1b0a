"""Power of a plan with heaps or shear cells: what the emulators expect it to show.

Data are simulated with each mechanism at rising strengths. The base parameters are those of the
plan's guesses. The errors are those of the plan and of the emulators, as a diagnosis draws data of
its base model. Each set is judged as a diagnosis judges it: the best gain of the catalogue and the
misfit against those of data without a mechanism.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnosis.chance import share_above
from diagnosis.fit import data_of, fit
from diagnosis.identify import NULL_STARTS, null_of, significant, simulate_data
from diagnosis.power import LEAST_SHARE, POWER, REPLICATES
from diagnosis.set_up_errors import log_evidence
from diagnosis.settings import BASE

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from diagnosis.model import Emulated


STEPS = 9  # strengths that are tried, the weakest left out


def power(
    emulated: Emulated,
    measurements: Sequence[Measurement],
    alpha: float = 0.05,
    replicates: int = REPLICATES,
    seed: int = 0,
) -> list[dict[str, Any]]:
    """[{experiment, law, of, unit, detectable, share, right, taken_for}] of a plan, as
    `diagnosis.power.power` has them; experiment: where the mechanism shows."""
    bench = _Bench(emulated, measurements, alpha, replicates, seed)
    return [bench.row(name) for name in bench.models if name != BASE]


class _Bench:
    """Draws data of a plan with a mechanism in them and lets the catalogue judge them."""

    def __init__(self, emulated, measurements, alpha, replicates, seed):
        self.measurements, self.alpha = measurements, alpha
        self.replicates, self.seed = replicates, seed
        conditions = [m.condition for m in measurements]
        self.models = {BASE: emulated.model(conditions)}
        self.models |= {n: emulated.model(conditions, [n]) for n in emulated.applicable(conditions)}
        guessed = data_of(measurements)
        # a plan's guesses need not fit one another: what counts is the model that fits them best
        value = fit(self.models[BASE], guessed).predicted
        self.data = replace(guessed, value=value)
        self.base = fit(self.models[BASE], self.data)
        rng = np.random.default_rng([seed, 3])
        null = null_of(self.models, self.base, measurements, self.data, replicates, rng)
        self.misfit = null.pop("misfit")
        self.best = np.max(list(null.values()), axis=0)

    def row(self, name):
        """Row of a mechanism: its strengths are halved until POWER of data show it."""
        model = self.models[name]
        mechanism = model.mechanisms[0]
        kinds = dict.fromkeys(m.experiment for m in self.measurements)
        shown = [k for k in kinds if k in mechanism.experiments]
        strength = mechanism.strength
        coded = strength.rising(STEPS + 1)[1:]
        row = {"experiment": " and ".join(shown), "law": name, "of": strength.name}
        row |= {"unit": strength.unit}
        low, high = 0, STEPS - 1
        share, names = self.shown(model, coded[high])
        if share < POWER:
            return row | {"detectable": None, "share": share, "right": None, "taken_for": {}}
        while low < high:
            middle = (low + high) // 2
            found = self.shown(model, coded[middle])
            if found[0] >= POWER:
                high, (share, names) = middle, found
            else:
                low = middle + 1
        taken = {n: v / len(names) for n, v in Counter(names).most_common() if n != name}
        return row | {
            "detectable": float(strength.natural(coded[high])),
            "share": share,
            "right": float(np.mean(np.array(names) == name)),
            "taken_for": {n: v for n, v in taken.items() if v >= LEAST_SHARE},
        }

    def shown(self, model, coded):
        """(share of data that alarm, what leads in those) with a mechanism at a coded strength."""
        theta = np.append(self.base.theta[0], coded)[None]
        value, error = model.predict(theta)
        truth = SimpleNamespace(
            theta=theta,
            predicted=value,
            sd=np.hypot(self.data.error, error),
            scale=np.ones(1),
            sizes=self.base.sizes,
        )
        rng = np.random.default_rng([self.seed, 5])
        drawn = simulate_data(model, truth, self.measurements, self.data, self.replicates, rng)
        base = fit(self.models[BASE], drawn)
        of_base = log_evidence(self.models[BASE], drawn, base)
        gains = {
            n: log_evidence(m, drawn, fit(m, drawn, NULL_STARTS)) - of_base
            for n, m in self.models.items()
            if n != BASE
        }
        table = np.array(list(gains.values()))
        lack = share_above(self.misfit, base.misfit)
        family = share_above(self.best, table.max(0))
        alarm = np.array(
            [significant(a, b, self.alpha)[1] for a, b in zip(lack, family, strict=True)]
        )
        return float(alarm.mean()), list(np.array(list(gains))[table.argmax(0)][alarm])
