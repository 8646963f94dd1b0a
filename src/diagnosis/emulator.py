"""A Gaussian process for one experiment under one law, taught by DEM runs, with its own error by leave-one-out.

The response is transformed by what is known of the experiment, so that the process learns a nearly linear rest:
log(rebound / height) is 2 log e, tan(sliding angle) is mu, shear stress over normal stress is a friction.
"""

import warnings
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

from diagnosis.design import MultipliedLever, inputs_of, multiplied, wanted
from diagnosis.quantities import POURED, QUANTITIES
from diagnosis.settings import BASE, catalogue_of, log_span


def forward(experiment, value, levers):
    """Transformed response; value in the quantity's unit, levers a mapping of floats or arrays."""
    return QUANTITIES[experiment].scale.forward(value, levers)


def inverse(experiment, z, levers):
    """Value in the quantity's unit and its derivative by z."""
    return QUANTITIES[experiment].scale.inverse(z, levers)


class Emulator:
    """z(x) for x in [0, 1]^d, from means z (n,) of `runs` (n,) at inputs x (n, d); one run at each unless given.

    `error` is the leave-one-out root mean square error in z, hyperparameters held, of the first `judged` means (all
    unless given); `spread` is the sd of z over the design. `scatter` is the sd of z from seed to seed, which is part of
    that error but not of the emulator's mean, where `scatters`; else what looks like noise counts as a wrong mean.
    """

    def __init__(self, x, z, judged=None, scatters=False, runs=None):
        x, z = np.asarray(x, float), np.asarray(z, float)
        runs = np.ones(len(z)) if runs is None else np.asarray(runs, float)
        self.mean, self.spread = float(z.mean()), float(z.std()) or 1.0
        process = _process(x, (z - self.mean) / self.spread, runs)
        self.x, self.alpha = x, process.alpha_
        smooth = process.kernel_.k1
        self.scale, self.length = smooth.k1.k1.constant_value, smooth.k1.k2.length_scale
        self.linear, self.offset = smooth.k2.k1.constant_value, smooth.k2.k2.sigma_0**2
        self._inverse = np.linalg.inv(process.kernel_(x))
        left_out = self.alpha / np.diag(self._inverse)
        self._misses = (self.spread * left_out) ** 2
        self.error = float(np.sqrt(np.mean(self._misses[:judged])))
        scatter = process.kernel_.k2.noise_level if scatters else 0.0
        self._nugget = scatter / runs.mean()
        self.scatter = self.spread * float(np.sqrt(scatter))
        self.runs = int(runs.sum())
        self._slope = self.linear * (self.x.T @ self.alpha)
        self._constant = self.linear * self.offset * float(self.alpha.sum())

    def __call__(self, x):
        """(k,) transformed responses at (k, d) inputs."""
        return self.with_slope(x, [])[0]

    def with_slope(self, x, columns, error=True):
        """Responses (k,), their derivatives (k, c) by the inputs in `columns`, and where `error` their variances (k,).

        The variance is the mean squared leave-one-out error of the runs nearby, weighted by their distance in
        the process' lengths, together with that of all runs at the weight of one; of it the share that is not scatter.
        """
        like = self._alike(x, self.x)
        # the derivative of a squared exponential is a difference of the same sums, weighted by the runs' inputs
        weights = self.scale * np.column_stack(
            [self.alpha, self.alpha[:, None] * self.x[:, columns]]
        )
        sums = like @ weights
        value = sums[:, 0] + x @ self._slope + self._constant
        slope = (sums[:, 1:] - x[:, columns] * sums[:, :1]) / self.length[columns] ** 2
        variance = self._variance(x, like) if error else None
        return (
            self.mean + self.spread * value,
            self.spread * (slope + self._slope[columns]),
            variance,
        )

    def _variance(self, x, like):
        near = like**4  # half the process' lengths
        variance = (near @ self._misses + self.error**2) / (near.sum(1) + 1.0)
        return variance * self._share_of_mean(x, like) if self._nugget else variance

    def correlation(self, x):
        """Correlation (k, k) of the errors at k inputs: of the process given its runs, for it is wrong smoothly."""
        cross = self._covariance(x, self.x, self._alike(x, self.x))
        own = self._covariance(x, x, self._alike(x, x))
        left = own - cross @ self._inverse @ cross.T
        # next to a run nothing is left but rounding, which is alike nowhere
        rounding = 1e-6 * np.diag(own).max()
        size = np.sqrt(np.maximum(np.diag(left), 0.0) + rounding)
        out = np.clip(left / np.outer(size, size), -1.0, 1.0)
        np.fill_diagonal(out, 1.0)
        return out

    def _alike(self, x, y):
        """Squared exponential (k, m) of the distances between (k, d) and (m, d) inputs, 1 where they are the same."""
        a, b = x / self.length, y / self.length
        square = (a * a).sum(1)[:, None] + (b * b).sum(1) - 2.0 * a @ b.T
        return np.exp(-0.5 * square)

    def _covariance(self, x, y, like):
        """Prior covariance (k, m) of the responses at (k, d) and (m, d) inputs that are `like` each other."""
        return self.scale * like + self.linear * (x @ y.T + self.offset)

    def _share_of_mean(self, x, like):
        """Variance of the process' mean (k,) over that of a run there."""
        cross = self._covariance(x, self.x, like)
        own = self.scale + self.linear * ((x * x).sum(1) + self.offset)
        mean = np.maximum(own - ((cross @ self._inverse) * cross).sum(1), 0.0)
        return mean / (mean + self._nugget)


@dataclass(frozen=True)
class Multiplied:
    """Emulator of a mechanism that multiplies a lever: that of the base model with the lever's input moved."""

    base: Emulator
    lever: MultipliedLever

    def with_slope(self, x, columns, error=True):
        """As `Emulator.with_slope`; the last input is the coded strength, last among the columns if it is there."""
        others = [c for c in columns if c != x.shape[1] - 1]
        z, slope, variance = self.base.with_slope(
            self.lever.moved(x), [*others, self.lever.column], error
        )
        slope[:, -1] *= self.lever.slope(x)
        return z, slope[:, : len(columns)], variance

    def correlation(self, x):
        """As `Emulator.correlation`."""
        return self.base.correlation(self.lever.moved(x))


class _Scatter(WhiteKernel):
    """Noise of means (n,): that of one run over the number of runs (n,) behind each."""

    def __init__(self, noise_level, noise_level_bounds, runs):
        super().__init__(noise_level, noise_level_bounds)
        self.runs = runs

    def __call__(self, X, Y=None, eval_gradient=False):
        if Y is not None:
            return super().__call__(X, Y)
        noise = np.diag(self.noise_level / self.runs)
        return (noise, noise[:, :, None]) if eval_gradient else noise


def _process(x, z, runs):
    """The fitted Gaussian process: squared exponential with a length an input, a linear trend, noise."""
    d = x.shape[1]
    kernel = (
        ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.full(d, 1.5), (0.15, 30.0))
        + ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, (1e-2, 1e2))
        + _Scatter(1e-3, (1e-8, 1.0), runs)
    )
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
        return process.fit(x, z)


def teach(rows, metrics, settings, factors):
    """{(experiment, mechanism): Emulator} and a table of their errors.

    rows: of `design.plan`; metrics: {run id: metrics or None}. A run that failed teaches nothing and is counted. Runs
    of the base model teach a mechanism too, at the strength at which it does nothing. One that multiplies a lever has
    no emulator but the base model's.
    """
    emulators, table = {}, []
    known = catalogue_of(settings, list(settings.experiments))
    finished, planned = _finished(rows, metrics)
    for key, own in finished.items():
        done = sum(len(r["run_ids"]) for r in own)
        if done < 0.5 * planned[key]:
            table.append({"experiment": key[0], "mechanism": key[1], "failed": planned[key]})
            continue
        off = None if key[1] == BASE else _coded_off(known[key[1]].strength)
        more = [] if off is None else _at_strength(off, finished[key[0], BASE])
        names = inputs_of(settings, factors, *key)
        emulators[key] = _teach_one(key[0], own, more, metrics, settings, names)
        table.append(
            {
                "experiment": key[0],
                "mechanism": key[1],
                "runs": done,
                "failed": planned[key] - done,
                "error": emulators[key].error,
                "scatter": emulators[key].scatter,
                "spread": emulators[key].spread,
            }
        )
    for experiment, name in wanted(settings, known, dict.fromkeys(e for e, _ in finished)):
        lever = multiplied(settings, factors, experiment, known.get(name))
        if lever and (experiment, BASE) in emulators:
            emulators[experiment, name] = Multiplied(emulators[experiment, BASE], lever)
    return emulators, table


def _finished(rows, metrics):
    """{(experiment, mechanism): rows with the runs that did not fail, those without any left out}, and how many runs
    were planned of each."""
    finished, planned = defaultdict(list), defaultdict(int)
    for row in rows:
        key = row["experiment"], row["mechanism"]
        ran = [n for n in row["run_ids"] if metrics[n] is not None]
        planned[key] += len(row["run_ids"])
        finished[key] += [row | {"run_ids": ran}] if ran else []
    return finished, planned


def _at_strength(coded, base):
    """Rows of the base model as rows of a mechanism at a coded strength; those at levers beyond the range left out."""
    inside = [r for r in base if 0.0 <= min(r["inputs"]) and max(r["inputs"]) <= 1.0]
    return [r | {"inputs": [*r["inputs"], coded]} for r in inside]


def _coded_off(strength):
    """Coded strength at which a mechanism does nothing; None where its range does not reach so far."""
    if strength.off is not None:
        return strength.coded(strength.off)
    return 0.0 if not strength.log and strength.low == 0.0 else None


def _teach_one(experiment, own, more, metrics, settings, names):
    rows = own + more
    x = np.array([r["inputs"] for r in rows])
    ranges = settings.experiments[experiment].levers
    levers = {n: np.array([log_span(*ranges[n], s) for s in x[:, names.index(n)]]) for n in ranges}
    metric = settings.experiments[experiment].metric
    runs = np.array([len(r["run_ids"]) for r in rows])
    row_of = np.repeat(np.arange(len(rows)), runs)
    y = np.array([metrics[n][metric] for r in rows for n in r["run_ids"]])
    z = forward(experiment, y, {n: v[row_of] for n, v in levers.items()})
    return Emulator(x, np.bincount(row_of, z) / runs, len(own), experiment in POURED, runs)
