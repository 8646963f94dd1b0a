"""The error of a reading, from its own replicates and what the others of its experiment say.

Few replicates tell their spread poorly. What the experiment's other settings say of it counts as
much as the spreads show that it does: they follow a law, about which each has its own as scaled
inverse chi-square with d degrees of freedom (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3), and d
is integrated out, from spreads that have little to do with one another to ones that are alike. The
law is constant, or a power of a lever where the slope stands out of what chance makes of it. The
doubt of the degrees of freedom that stand behind a spread widens it as Student's t is wider than
the normal law.

A batch (a lot of grains, a day) shifts all its readings of an experiment alike, and so does an
instrument. How large such errors are the model of the table tells (`diagnosis.table_model.block`).
"""

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import betaln, gammaln, polygamma, psi
from scipy.stats import norm, t

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.statistics.numbers import NORMAL_95

DEGREES = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, np.inf])
"""Degrees of freedom d of the law, alike probable."""

SLOPE = 0.05
"""Chance of a slope over any lever, of spreads that are alike, below which the law has one."""

LEAST_LEVELS = 3  # of a lever over which a slope is looked for
LEAST_SPREAD = 0.1  # of the pooled spread: rounded readings may all be alike


def spread_unit(measurements: Sequence[Measurement]) -> np.ndarray:
    """(n,) what spreads are compared in: the value where they go with it, else 1."""
    return np.array([m.value if QUANTITIES[m.experiment].relative else 1.0 for m in measurements])


def stated_sd(measurements: Sequence[Measurement], own: np.ndarray | None = None) -> np.ndarray:
    """(..., n) standard deviations of a replicate, its doubt with it. See the module.

    own: (..., n) spreads of the replicates, those of the measurements unless given. A spread that
    is given with a single value is taken as it is."""
    unit = spread_unit(measurements)
    out = np.array([m.sd for m in measurements] if own is None else own, float) / unit
    freedom = np.array([m.n - 1.0 for m in measurements])
    kinds = np.array([m.experiment for m in measurements])
    for kind in set(kinds):
        rows = np.flatnonzero((kinds == kind) & (freedom > 0.0))
        if len(rows):
            levers = _levers([measurements[int(i)] for i in rows])
            out[..., rows] = _with_doubt(out[..., rows], freedom[rows], levers)
    return unit * out


def redrawn_share(
    error: np.ndarray, n: np.ndarray, replicates: int, rng: np.random.Generator
) -> np.ndarray:
    """Errors (replicates, k) that laboratories would state over the true ones `error` (k,), of
    settings of one experiment with n (k,) replicates."""
    freedom, some = np.maximum(n - 1.0, 1.0), n > 1
    draws = rng.chisquare(freedom, (replicates, len(n))) / freedom
    found = np.where(some, np.sqrt(draws), 1.0)  # the spread of the replicates over the true one
    if some.any():
        true = error[some] * np.sqrt(n[some])
        found[:, some] = _with_doubt(true * found[:, some], n[some] - 1.0, {}) / true
    return found


def _levers(measurements):
    """{lever: logarithms (k,)} of those that all rows have, at LEAST_LEVELS or more."""
    out = {}
    for name in LEVERS:
        values = np.array([m.levers.get(name) or np.nan for m in measurements])
        if (values > 0.0).all() and len(np.unique(values)) >= LEAST_LEVELS:
            out[name] = np.log(values)
    return out


def _with_doubt(own, freedom, levers):
    """Spreads (..., k) with what the others say of them and their doubt."""
    if len(freedom) == 1:
        return own * doubt(freedom)
    pooled = np.sqrt((freedom * own**2).sum(-1, keepdims=True) / freedom.sum())
    square = np.maximum(own, np.maximum(LEAST_SPREAD * pooled, 1e-12)) ** 2
    law, spent = _law(square, freedom, levers)
    density, variance = [], []
    for d in DEGREES:
        far = np.isinf(d)
        scale = np.exp(law if far else law + psi(d / 2.0) - np.log(d / 2.0))
        density.append(_log_density(square / scale, freedom, d).sum(-1))
        mixed = scale if far else (d * scale + freedom * square) / (d + freedom)
        behind = np.minimum(d + freedom, freedom.sum() - spent[..., None])
        variance.append(mixed * doubt(behind) ** 2)
    weight = np.exp(np.array(density) - np.max(density, axis=0))
    weight /= weight.sum(0)
    return np.sqrt((weight[..., None] * np.array(variance)).sum(0))


def _law(square, freedom, levers):
    """Logarithms (..., k) of what the experiment's spreads say of each square, and the degrees of
    freedom (...) that a slope has spent."""
    logs = np.log(square) - (psi(freedom / 2.0) - np.log(freedom / 2.0))
    weight = 1.0 / polygamma(1, freedom / 2.0)
    law = np.repeat((logs @ weight / weight.sum())[..., None], len(freedom), axis=-1)
    best, spent = np.zeros(logs.shape[:-1]), np.zeros(logs.shape[:-1])
    least, level = norm.isf(SLOPE / (2.0 * max(len(levers), 1))), law
    for values in levers.values():
        x = values - values @ weight / weight.sum()
        size = weight @ x**2
        slope = logs @ (weight * x) / size
        stands_out = np.abs(slope) * np.sqrt(size)
        better = stands_out > np.maximum(best, least)
        law = np.where(better[..., None], level + slope[..., None] * x, law)
        best, spent = np.where(better, stands_out, best), np.where(better, 1.0, spent)
    return law, spent


def _log_density(ratio, freedom, d):
    """Log density (..., k) of the logarithm of spreads' squares over the law's, with d degrees."""
    half = freedom / 2.0
    if np.isinf(d):
        return half * (np.log(half) + np.log(ratio) - ratio) - gammaln(half)
    more = half * np.log(freedom * ratio / d) - betaln(half, d / 2.0)
    return more - (half + d / 2.0) * np.log1p(freedom * ratio / d)


def doubt(freedom: np.ndarray) -> np.ndarray:
    """Factor (...) on a spread of so many degrees of freedom (...) by which Student's 95 % are the
    normal law's."""
    return t.ppf(0.5 + 0.5 * 0.95, freedom) / NORMAL_95


LABELS = ("batch", "instrument")
"""Columns of a table that say what readings share beside their levers."""


def sizes_of(names: Iterable[Any], sizes: Sequence[float], most: int = 2) -> list[dict[Any, float]]:
    """[{name: size}] of the sizes that are tried of errors: none, and each of at most so many of
    the names at once."""
    choices = [{}]  # type: ignore[var-annotated]
    for count in range(1, most + 1):
        for chosen in combinations(names, count):
            for own in np.array(np.meshgrid(*[sizes] * count)).reshape(count, -1).T:
                choices.append(dict(zip(chosen, own, strict=True)))
    return choices
