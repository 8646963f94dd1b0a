"""Ways to calibrate: each spends a given number of runs and answers with a point and intervals.

Runs are coded points (n, 3) and their responses (n,) [deg]. An answer is a point (3,) and low, high
(3,) of its stated 95 % intervals, all in coded levels; None where a way states none. The posterior
is had on a grid, which leaves the sampler's noise out.
"""

import numpy as np
import pandas as pd
from scipy.stats import qmc

from benchmarks.ways.truths import Bench
from calibration.errors import CalibrationError
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.likelihood import Response
from calibration.statistics.design import box_behnken
from calibration.statistics.numbers import NORMAL_95
from calibration.statistics.optimise import solve
from calibration.statistics.surface import fit_surface, parameter_interval
from calibration.study.factors import Factor

CODES = ["A", "B", "C"]
FACTORS = [Factor(c, c, c, -1.0, 1.0) for c in CODES]
GRID = np.linspace(-1.0, 1.0, 25)
CUBE = np.stack(np.meshgrid(GRID, GRID, GRID, indexing="ij"), -1).reshape(-1, 3)
STARTED, BATCH = 12, 10  # runs of the space-filling start, and of each batch after it
LEVEL = 0.95
CUT = 3.0
"""Implausibility from which a point is ruled out: 95 % of any distribution with one peak lie within
(Pukelsheim 1994, American Statistician 48:88)."""


Runs = tuple[np.ndarray, np.ndarray]
Answer = tuple[np.ndarray, np.ndarray | None, np.ndarray | None]


def box_behnken_and_candidate(bench: Bench, runs: int) -> Runs:
    """The chain's design; what is left of the runs goes to the surface's optimum."""
    x = box_behnken(FACTORS)[CODES].to_numpy(float)
    y = bench.run(x)
    left = runs - len(x)
    if left:
        candidate = solve(_surface(x, y), bench.measured).chosen
        more = np.tile(candidate, (left, 1))
        x, y = np.vstack([x, more]), np.concatenate([y, bench.run(more)])
    return x, y


def chain(bench: Bench, x: np.ndarray, y: np.ndarray) -> Answer:
    """The paper's chain: quadratic, the point of the solution set nearest to the centre, each
    parameter's interval with the others held."""
    surface = _surface(x, y)
    point = solve(surface, bench.measured).chosen
    ends = [
        parameter_interval(surface, bench.measured, point, k, 1 - LEVEL, bench.se, 24)
        for k in range(3)
    ]
    return point, *np.array(ends).T


def solution_set(bench: Bench, x: np.ndarray, y: np.ndarray) -> Answer:
    """The same point with the extent of the solution set, which is no 95 % interval."""
    found = solve(_surface(x, y), bench.measured)
    return found.chosen, found.low, found.high


def posterior(bench: Bench, x: np.ndarray, y: np.ndarray) -> Answer:
    """The emulated posterior of the same runs, and the probable point nearest to the centre."""
    emulator = GaussianProcess().fit(0.5 + 0.5 * x, y)
    weight = _weights(emulator, bench)
    order = np.sort(weight)[::-1]
    probable = weight >= order[np.searchsorted(np.cumsum(order), 0.5)]
    mean = emulator.mean(0.5 + 0.5 * CUBE[probable])[0]
    near = np.abs(mean - bench.measured) + 0.05 * np.linalg.norm(CUBE[probable], axis=1)
    return CUBE[probable][np.argmin(near)], *intervals(weight)


def adaptive(bench: Bench, runs: int) -> Runs:
    """Runs of an adaptive posterior: a space-filling start, then batches at draws of it."""

    def draws(emulator, n):
        return CUBE[bench.rng.choice(len(CUBE), n, p=_weights(emulator, bench))]

    return _in_batches(bench, runs, draws)


def straddle(bench: Bench, runs: int) -> Runs:
    """Runs of a Gaussian-process optimiser: a space-filling start, then batches where the target
    may be met and least is known (the straddle of Bryan et al. 2005, Advances in Neural Information
    Processing Systems 18:163)."""

    def best(emulator, n):
        some = CUBE[bench.rng.choice(len(CUBE), 2000, replace=False)]
        mean, variance = emulator.mean(0.5 + 0.5 * some)
        merit = NORMAL_95 * np.sqrt(variance) - np.abs(mean - bench.measured)
        picked = []
        for _ in range(n):
            far = np.ones(len(some), bool)
            for p in picked:
                far &= np.linalg.norm(some - p, axis=1) > 0.4
            picked.append(some[np.argmax(np.where(far, merit, -np.inf))])
        return np.array(picked)

    return _in_batches(bench, runs, best)


def not_ruled_out(bench: Bench, runs: int) -> Runs:
    """Runs of history matching: a space-filling start, then waves drawn evenly from what is not
    ruled out yet (Vernon et al. 2010, Bayesian Analysis 5:619)."""

    def wave(emulator, n):
        left = CUBE[_implausible(emulator, bench) <= CUT]
        left = left if len(left) else CUBE
        return left[bench.rng.choice(len(left), n, replace=len(left) < n)]

    return _in_batches(bench, runs, wave)


def history_matching(bench: Bench, x: np.ndarray, y: np.ndarray) -> Answer:
    """The extent of what is not ruled out, which is no 95 % interval, and the point of it that is
    the most plausible. Raises CalibrationError where all is ruled out."""
    implausible = _implausible(GaussianProcess().fit(0.5 + 0.5 * x, y), bench)
    left = CUBE[implausible <= CUT]
    if not len(left):
        raise CalibrationError("history matching has ruled out every point")
    return CUBE[np.argmin(implausible)], left.min(axis=0), left.max(axis=0)


def _implausible(emulator, bench):
    """Distance (n,) from the measured mean at the cube's grid points, in standard deviations of the
    emulator's and the measurement's error together."""
    mean, variance = emulator.mean(0.5 + 0.5 * CUBE)
    return np.abs(mean - bench.measured) / np.sqrt(variance + bench.se**2)


def optimiser(bench: Bench, x: np.ndarray, y: np.ndarray) -> Answer:
    """The point where its process is nearest to the target; it states no interval."""
    emulator = GaussianProcess().fit(0.5 + 0.5 * x, y)
    miss = np.abs(emulator.mean(0.5 + 0.5 * CUBE)[0] - bench.measured)
    return CUBE[np.argmin(miss)], None, None


def _in_batches(bench, runs, chosen):
    x = 2.0 * qmc.Sobol(3, seed=bench.rng).random(16)[:STARTED] - 1.0
    x = np.vstack([x, np.zeros((4, 3))])  # repeats at the centre tell the scatter
    y = bench.run(x)
    while len(x) < runs:
        emulator = GaussianProcess().fit(0.5 + 0.5 * x, y)
        more = chosen(emulator, min(BATCH, runs - len(x)))
        x, y = np.vstack([x, more]), np.concatenate([y, bench.run(more)])
    return x, y


def _surface(x, y):
    return fit_surface(pd.DataFrame(x, columns=CODES), CODES, y)


def _weights(emulator, bench):
    """Posterior probability (n,) of the cube's grid points."""
    target = Response("heap", emulator, bench.measured, bench.se**2)
    log = target.log_likelihood(0.5 + 0.5 * CUBE)
    weight = np.exp(log - log.max())
    return weight / weight.sum()


def intervals(weight: np.ndarray) -> np.ndarray:
    """(low, high), (3,) each, of the marginals of probabilities (n,) of the cube's grid points;
    between grid points straight lines."""
    table, ends = weight.reshape([len(GRID)] * 3), []
    edges = np.concatenate([[-1.0], 0.5 * (GRID[1:] + GRID[:-1]), [1.0]])
    for k in range(3):
        marginal = table.sum(axis=tuple(i for i in range(3) if i != k))
        # the outermost cells are half as wide, as the box ends there
        marginal[[0, -1]] *= 0.5
        cumulated = np.concatenate([[0.0], np.cumsum(marginal / marginal.sum())])
        ends.append(np.interp([0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], cumulated, edges))
    return np.array(ends).T


WAYS = {
    # name: (how the runs are spent, what is made of them)
    "paper's chain": (box_behnken_and_candidate, chain),
    "solution set of the chain": (box_behnken_and_candidate, solution_set),
    "posterior, the chain's runs": (box_behnken_and_candidate, posterior),
    "posterior, adaptive runs": (adaptive, posterior),
    "Gaussian-process optimiser": (straddle, optimiser),
    "history matching": (not_ruled_out, history_matching),
}


def answer(way: str, bench: Bench, runs: int) -> Answer | None:
    """Return what a way answers with so many runs; None where it ends with an error."""
    spend, conclude = WAYS[way]
    try:
        return conclude(bench, *spend(bench, runs))
    except CalibrationError:
        return None
