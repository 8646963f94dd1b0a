"""Errors that readings of one batch or one instrument share, where experiments are emulated.

A batch (a lot of grains, a day) shifts all its readings of an experiment alike, and so does an
instrument. The shift is normal; its standard deviation is one of a grid, none among them, with a
half Cauchy prior. `diagnosis.fit` weighs the grid by the likelihood of the readings with all
parameters integrated out (REML: Patterson and Thompson 1971, Biometrika 58:545).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES

LABELS = ("batch", "instrument")
"""Columns of a table that say what readings share beside their levers."""

TIMES = (1.5, 4.0, 10.0)
"""Standard deviations of a shared error that are tried, in units of the median error of a setting;
and none."""

USUAL = 2.0  # scale of their prior, in the same unit


@dataclass(frozen=True)
class Shared:
    """Grid of the shared errors of n readings: covariance (g, n, n) in their units, log prior (g,),
    and the standard deviations {(experiment, label): (g,)} of each, in its experiment's unit or as
    a share of the reading."""

    covariance: np.ndarray
    prior: np.ndarray
    sds: dict

    def only(self, place: int) -> "Shared":
        """The same with the sizes at `place` alone."""
        one = slice(place, place + 1)
        sds = {k: v[one] for k, v in self.sds.items()}
        return Shared(self.covariance[one], self.prior[one], sds)

    def at(self, place: int) -> dict[tuple[str, str], float]:
        """{(experiment, label): standard deviation} of those that are not zero."""
        return {k: float(v[place]) for k, v in self.sds.items() if v[place] > 0.0}


def shared_of(
    measurements: Sequence[Measurement], error: np.ndarray, unit: np.ndarray
) -> Shared | None:
    """`Shared` of measurements whose standard errors are `error` (n,) and whose spreads are
    compared in `unit` (n,), or None where no column tells readings of an experiment apart."""
    kinds = {}
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [i for i, m in enumerate(measurements) if m.experiment == kind]
        for name in LABELS:
            if len({getattr(measurements[i], name) for i in own}) > 1:
                kinds[kind, name] = float(np.median((error / unit)[own]))
    if not kinds:
        return None
    choices = sizes_of(kinds, TIMES)
    prior = np.array([-sum(np.log1p((t / USUAL) ** 2) for t in c.values()) for c in choices])
    sds = {k: np.array([size * c.get(k, 0.0) for c in choices]) for k, size in kinds.items()}
    each = [{k: v[g] for k, v in sds.items()} for g in range(len(choices))]
    return Shared(np.array([covariance_of(measurements, unit, s) for s in each]), prior, sds)


def sizes_of(names: Iterable[Any], sizes: Sequence[float], most: int = 2) -> list[dict[Any, float]]:
    """[{name: size}] of the sizes that are tried of errors: none, and each of at most so many of
    the names at once."""
    choices = [{}]  # type: ignore[var-annotated]
    for count in range(1, most + 1):
        for chosen in combinations(names, count):
            for own in np.array(np.meshgrid(*[sizes] * count)).reshape(count, -1).T:
                choices.append(dict(zip(chosen, own, strict=True)))
    return choices


def covariance_of(
    measurements: Sequence[Measurement], unit: np.ndarray, sds: Mapping[tuple[str, str], float]
) -> np.ndarray:
    """(n, n) covariance of the errors that measurements share, of standard deviations `sds`
    {(experiment, label): in `unit` (n,)}. A row without a label shares nothing."""
    n = len(measurements)
    out = np.zeros((n, n))
    for (kind, name), sd in sds.items():
        labels = [getattr(m, name) if m.experiment == kind else "" for m in measurements]
        same = np.array([[a == b != "" for b in labels] for a in labels])
        out += same * np.outer(sd * unit, sd * unit)
    return out


def scatter(sds: Mapping[tuple[str, str], float]) -> list[dict[str, Any]]:
    """[{experiment, of, sd, unit}] of `Shared.at`, as verdict.json has them."""
    return [
        {
            "experiment": kind,
            "of": name,
            "sd": sd,
            "unit": "share" if QUANTITIES[kind].relative else QUANTITIES[kind].unit,
        }
        for (kind, name), sd in sds.items()
    ]
