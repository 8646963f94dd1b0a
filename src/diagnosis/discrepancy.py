"""What the calibrated model misses, as a curve over the levers: shown where nothing that was tried
explains it.

The residuals of each experiment are a Gaussian process over the logarithms of its levers; its size
and its smoothness are averaged over a grid by their likelihood (Kennedy and O'Hagan 2001, J. R.
Stat. Soc. B 63:425, with the parameters held). The setting that is asked for is the one at which
the process is least known in units of a measurement's error.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.statistics.numbers import NORMAL_95
from calibration.statistics.ties import first_largest

SIZES = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
"""Standard deviations of the process that are tried, in median errors of a setting."""

LENGTHS = (0.3, 0.6, 1.2)  # correlation lengths that are tried, over a lever's range from -1 to 1
POINTS = 9
DECIMALS = 3  # of a setting that is proposed, significant


def curves(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """[{experiment, lever, unit, at, value, low, high}] of the rows of `residuals`, along each
    lever that varies, the others at their medians; the band holds each point with 95 %.

    unit `share`: of the prediction; else the quantity's, measured less predicted."""
    out = []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = _Residuals(kind, rows)
        for k, name in enumerate(own.levers):
            x = np.tile(np.median(own.x, axis=0), (POINTS, 1))
            x[:, k] = np.linspace(-1.0, 1.0, POINTS)
            mean, sd = own.process(x)
            out.append(
                {
                    "experiment": kind,
                    "lever": name,
                    "unit": own.unit,
                    "at": [float(v) for v in own.natural(x)[:, k]],
                    "value": [float(v) for v in mean],
                    "low": [float(v) for v in mean - NORMAL_95 * sd],
                    "high": [float(v) for v in mean + NORMAL_95 * sd],
                }
            )
    return out


def least_known(
    rows: Sequence[Mapping[str, Any]], ranges: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, Any] | None:
    """The setting where the discrepancy is least known, as a `next_measurement`; None where no
    lever varies.

    ranges: {experiment: {lever: (low, high)}} that may be set; those of the rows unless given.
    """
    best = None
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = _Residuals(kind, rows)
        if not own.levers:
            continue
        levers = _grid(own, (ranges or {}).get(kind, {}))
        mean, sd = own.process(own.scaled(levers))
        bits = 0.5 * np.log2(1.0 + (sd / np.median(own.error)) ** 2)
        k = first_largest(bits)
        if best is None or bits[k] > best["information_bits"]:
            # a share is of the prediction at the nearest setting that was measured
            level = own.predicted[own.nearest(levers[k])] if own.unit == "share" else 1.0
            told = {"value": float(mean[k] * level), "sd": float(sd[k] * level)}
            best = {
                "experiment": kind,
                "levers": dict(zip(own.levers, levers[k].tolist(), strict=True)),
                "information_bits": float(bits[k]),
                "predictions": {"what the model misses there": told},
            }
    return best


def _grid(own, ranges):
    """Settings (k, d): the ends and the middle of each lever, and the middles between them."""
    along = []
    for name, low, high in zip(own.levers, own.low, own.high, strict=True):
        low, high = ranges.get(name, (low, high))
        values = np.geomspace(low, high, 5)
        along.append([min(max(float(f"{v:.{DECIMALS}g}"), low), high) for v in values])
    return np.array(list(itertools.product(*along)))


class _Residuals:
    """Residuals (n,) of an experiment with errors, and levers x (n, d) scaled to [-1, 1]."""

    def __init__(self, kind, rows):
        own = [r for r in rows if r["experiment"] == kind]
        self.predicted = np.array([r["predicted"] for r in own])
        miss = np.array([r["measured"] for r in own]) - self.predicted
        error = np.array([r["sd"] for r in own])
        share = QUANTITIES[kind].relative
        unit = self.predicted if share else np.ones(len(own))
        self.unit = "share" if share else QUANTITIES[kind].unit
        self.residual, self.error = miss / unit, error / unit
        values = {n: np.array([r["levers"].get(n, np.nan) for r in own]) for n in LEVERS}
        # a camera's interval of zero has no logarithm, and a lever that some rows lack no scale
        kept = {n: v for n, v in values.items() if (v > 0).all() and np.ptp(v) > 0}
        self.levers = list(kept)
        table = np.array(list(kept.values())).reshape(len(kept), len(own)).T
        self.low, self.high = (table.min(0), table.max(0)) if kept else (np.zeros(0), np.zeros(0))
        self.x = self.scaled(table)
        self._fit()

    def nearest(self, levers):
        """Index of the measured setting that is nearest to one of levers (d,)."""
        return int(np.argmin(((self.x - self.scaled(levers[None])) ** 2).sum(1)))

    def scaled(self, levers):
        """Levers (k, d) over the plan's range, -1 to 1."""
        span = np.log(self.high / self.low)
        return 2.0 * np.log(levers / self.low) / span - 1.0

    def natural(self, x):
        """The inverse of `scaled`."""
        return self.low * (self.high / self.low) ** (0.5 * (x + 1.0))

    def _fit(self):
        noise, sizes = np.diag(self.error**2), SIZES * np.median(self.error)
        self.grid = list(itertools.product(sizes, LENGTHS if self.levers else LENGTHS[:1]))
        total = [noise + _kernel(self.x, self.x, *at) for at in self.grid]
        self._inverse = [np.linalg.inv(t) for t in total]
        fits = [
            -0.5 * (self.residual @ i @ self.residual + np.linalg.slogdet(t)[1])
            for i, t in zip(self._inverse, total, strict=True)
        ]
        weight = np.exp(np.array(fits) - max(fits))
        self.weight = weight / weight.sum()

    def process(self, x):
        """Mean and standard deviation (k,) of the discrepancy at x (k, d)."""
        means, variances = [], []
        for (size, length), inverse in zip(self.grid, self._inverse, strict=True):
            cross = _kernel(x, self.x, size, length)
            gain = cross @ inverse
            means.append(gain @ self.residual)
            variances.append(2.0 * size**2 - (gain * cross).sum(1))
        means, variances = np.array(means), np.maximum(variances, 0.0)
        mean = self.weight @ means
        second = self.weight @ (variances + means**2)
        return mean, np.sqrt(np.maximum(second - mean**2, 0.0))


def _kernel(x, y, size, length):
    """Covariance (k, m) of the discrepancy at x (k, d) and y (m, d): of its level, for an
    experiment may be off as a whole, and of its shape."""
    square = ((x[:, None] - y[None, :]) ** 2).sum(2)
    return size**2 * (1.0 + np.exp(-0.5 * square / length**2))
