"""What the calibrated base model gets wrong: residuals along each lever in words, and the
discrepancy over the levers, which is shown where nothing that was tried explains it.

The discrepancy of each experiment is a Gaussian process over the logarithms of its levers; its size
and its smoothness are averaged over a grid by their likelihood (Kennedy and O'Hagan 2001, J. R.
Stat. Soc. B 63:425, with the parameters held). The setting that is asked for is the one at which
the process is least known in units of a measurement's error.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibration.figures import parameter_words
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.statistics.numbers import NORMAL_95
from calibration.statistics.ties import first_largest
from diagnosis.design import WIDENED
from diagnosis.fit import Fit
from diagnosis.model import Model
from diagnosis.next_measurement import DECIMALS
from diagnosis.page.words import at as at_lever
from diagnosis.page.words import told


def residual_rows(
    measurements: Sequence[Measurement], **values: np.ndarray
) -> list[dict[str, Any]]:
    """A mapping for each condition: its levers and what was recorded beside, measured, and what is
    `values` (n,) of all.

    Values are `predicted` (with what its batch and its instrument add), its `sd`, of emulated
    experiments that of the reading alone, `reading_sd`, and the residual in sd, `standardised`."""
    return [
        {"experiment": m.experiment, "levers": m.levers | m.covariates, "measured": m.value}
        | {key: float(own[i]) for key, own in values.items()}
        for i, m in enumerate(measurements)
    ]


def patterns(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """[{experiment, lever, sentence}]: how far the readings of the rows of `residuals` are from the
    model at both ends of each lever that varies, or over all settings of an experiment of which no
    lever shows it (lever None)."""
    out = []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = [r for r in rows if r["experiment"] == kind]
        head = f"The measured {QUANTITIES[kind].words}"
        found: list[tuple[str | None, str]] = []
        for lever in dict.fromkeys(n for r in own for n in r["levers"]):
            at = [r["levers"].get(lever, np.nan) for r in own]
            ends = [[r for r, v in zip(own, at, strict=True) if v == end]
                    for end in (np.nanmax(at), np.nanmin(at))]  # fmt: skip
            told = [f"{_distance(e)} at {at_lever(lever, e[0]['levers'][lever])}" for e in ends]
            if ends[0] != ends[1] and not all(map(_agrees, ends)):
                found.append((lever, f"{head} {', and '.join(told)}."))
        if not found and not _agrees(own):
            where = f"over its {len(own)} settings" if len(own) > 1 else "at its one setting"
            found = [(None, f"{head} {_distance(own)} {where}.")]
        out += [{"experiment": kind, "lever": n, "sentence": text} for n, text in found]
    return out


def _agrees(rows):
    """Return whether the mean of rows agrees with the model within one standard error."""
    return abs(np.mean([r["standardised"] for r in rows])) * np.sqrt(len(rows)) < 1.0


def _distance(rows):
    """Mean distance of the measured values from the model in words."""
    if _agrees(rows):
        return "agrees with the model"
    share = np.mean([r["measured"] / r["predicted"] - 1.0 for r in rows])
    return f"{'exceeds' if share > 0 else 'falls short of'} the model by {100 * abs(share):.2g} %"


def moved(
    before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Parameters that the extended model still determines, outside the base calibration's interval.

    {name: {base, extended, shift_percent, shift_in_base_sd, sentence}}; the shift is how wrong the
    base had been."""
    out = {}
    for name, old in before.items():
        new = after[name]
        if not new["identified"] or old["low"] <= new["value"] <= old["high"]:
            continue
        shift = old["value"] - new["value"]
        row: dict[str, Any] = {"base": old["value"], "extended": new["value"]}
        row |= {"shift_percent": float(100.0 * shift / new["value"])}
        row |= {"shift_in_base_sd": float(shift / old["sd"])}
        out[name] = row | {"sentence": told("moved.j2", words=new["words"], row=row)}
    return out


def calibration(model: Model, fitted: Fit) -> dict[str, dict[str, Any]]:
    """A mapping for each parameter: mode, standard deviation, 95 % interval cut at the emulators'
    range, the share of the prior's sd that is left, and whether the data identify it (the data must
    halve the prior's sd)."""
    out = {}
    sd = np.sqrt(np.diag(fitted.cov[0]))
    for k, factor in enumerate(model.factors):
        mode = fitted.theta[0, k]
        ends = (np.clip(mode + z * sd[k], -WIDENED, WIDENED) for z in (-NORMAL_95, NORMAL_95))
        own = *(factor.natural(float(v)) for v in (mode, *ends)), sd[k] / model.prior_sd[k]
        value, low, high, left = map(float, own)
        out[factor.name] = calibrated(
            factor.key, value, float(sd[k] * factor.half_range), low, high, left,
            bool(abs(mode) > WIDENED - 0.01),
        )  # fmt: skip
    return out


def calibrated(
    key: str, value: float, sd: float, low: float, high: float, left: float, at_bound: bool
) -> dict[str, Any]:
    """What is told of a calibrated coefficient; left: of the prior's standard deviation."""
    out = {"value": value, "sd": sd, "low": low, "high": high, "prior_sd_left": left}
    more = {"identified": left < 0.5, "at_bound": at_bound, "words": parameter_words(key)}
    return {**out, **more}


SIZES = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
"""Standard deviations of the process that are tried, in median errors of a setting."""

LENGTHS = (0.3, 0.6, 1.2)  # correlation lengths that are tried, over a lever's range from -1 to 1
POINTS = 9


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
            ends = {"low": mean - NORMAL_95 * sd, "high": mean + NORMAL_95 * sd}
            values = {"at": own.natural(x)[:, k], "value": mean} | ends
            row = {"experiment": kind, "lever": name, "unit": own.unit}
            out.append(row | {key: value.tolist() for key, value in values.items()})
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
            near = ((own.x - own.scaled(levers[k][None])) ** 2).sum(1).argmin()
            level = own.predicted[near] if own.unit == "share" else 1.0
            expected = {"value": float(mean[k] * level), "sd": float(sd[k] * level)}
            best = {
                "experiment": kind,
                "levers": dict(zip(own.levers, levers[k].tolist(), strict=True)),
                "information_bits": float(bits[k]),
                "predictions": {"what the model misses there": expected},
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
        if kept:  # without a lever there is nothing that it could follow
            self._fit()

    def scaled(self, levers):
        """Levers (k, d) over the plan's range, -1 to 1."""
        span = np.log(self.high / self.low)
        return 2.0 * np.log(levers / self.low) / span - 1.0

    def natural(self, x):
        """The inverse of `scaled`."""
        return self.low * (self.high / self.low) ** (0.5 * (x + 1.0))

    def _fit(self):
        """The processes that are tried, and how probable each is."""
        from sklearn.gaussian_process import GaussianProcessRegressor  # a second to import
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel

        self.processes = []
        for size, length in itertools.product(SIZES * np.median(self.error), LENGTHS):
            # of its level, for an experiment may be off as a whole, and of its shape
            kernel = ConstantKernel(size**2) + ConstantKernel(size**2) * RBF(length)
            process = GaussianProcessRegressor(kernel, alpha=self.error**2, optimizer=None)
            self.processes.append(process.fit(self.x, self.residual))
        fits = np.array([p.log_marginal_likelihood_value_ for p in self.processes])
        weight = np.exp(fits - fits.max())
        self.weight = weight / weight.sum()

    def process(self, x):
        """Mean and standard deviation (k,) of the discrepancy at x (k, d)."""
        means, sds = zip(*(p.predict(x, return_std=True) for p in self.processes), strict=True)
        mean = self.weight @ np.array(means)
        second = self.weight @ (np.array(sds) ** 2 + np.array(means) ** 2)
        return mean, np.sqrt(np.maximum(second - mean**2, 0.0))
