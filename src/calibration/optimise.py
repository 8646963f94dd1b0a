"""Solving response surfaces for targets: the whole set of solutions, the chosen point, desirability."""

from dataclasses import dataclass

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from calibration.errors import CalibrationError

RULES = ("closest_to_centre", "smallest_prediction_variance")
CANDIDATES = 4096


@dataclass(frozen=True)
class Solution:
    """Points (m, factors) in coded levels whose prediction is the target, and the one that was chosen."""

    target: float
    attainable: bool
    chosen: np.ndarray
    predicted: float
    points: np.ndarray
    rule: str

    def extent(self):
        """(low, high), (factors,) each, of the solution set."""
        return self.points.min(0), self.points.max(0)


def solve(surface, target, rule="closest_to_centre", seed=1):
    """All points of the cube [-1, 1]^k where `surface` predicts `target`, and one of them chosen by `rule`.

    The set is a surface in the cube. It is sampled by following random lines through the cube to their crossings.
    Where the target is out of reach, the point of nearest prediction is returned and `attainable` is False.
    """
    if rule not in RULES:
        raise CalibrationError(f"unknown rule {rule!r}; known: {', '.join(RULES)}")
    k = len(surface.codes)
    points = _crossings(surface, target, k, seed)
    if not len(points):
        chosen = _nearest(surface, target, k, seed)
        return Solution(
            target, False, chosen, float(surface.predict([chosen])[0]), chosen[None], rule
        )
    merit = (points**2).sum(1) if rule == "closest_to_centre" else surface.standard_error(points)
    chosen = _polish(surface, target, points[np.argmin(merit)], rule)
    return Solution(target, True, chosen, float(surface.predict([chosen])[0]), points, rule)


def _crossings(surface, target, k, seed):
    """Points where lines between quasi-random pairs of points cross the target; exact for a quadratic along a line."""
    pairs = 2.0 * qmc.Sobol(2 * k, seed=seed).random(CANDIDATES) - 1.0
    a, b = pairs[:, :k], pairs[:, k:]
    fa, fm, fb = (surface.predict(p) - target for p in (a, 0.5 * (a + b), b))
    # f(t) = c2 t^2 + c1 t + c0 through t = 0, 1/2, 1
    c2, c1, c0 = 2 * fa - 4 * fm + 2 * fb, -3 * fa + 4 * fm - fb, fa
    root = np.sqrt(np.maximum(c1**2 - 4 * c2 * c0, 0.0))
    real = c1**2 - 4 * c2 * c0 >= 0.0
    found = []
    for sign in (-1.0, 1.0):
        q = -0.5 * (c1 + sign * np.where(c1 >= 0, 1.0, -1.0) * root)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(sign > 0, q / c2, c0 / q)
        ok = real & np.isfinite(t) & (t >= 0.0) & (t <= 1.0)
        point = a[ok] + t[ok, None] * (b[ok] - a[ok])
        found.append(point[np.abs(surface.predict(point) - target) < 1e-6 * max(abs(target), 1.0)])
    return np.concatenate(found)


def _polish(surface, target, start, rule):
    """The best point by the rule on the solution set itself, started from the best sample."""

    def merit(x):
        return (
            float(x @ x) if rule == "closest_to_centre" else float(surface.standard_error([x])[0])
        )

    constraint = {"type": "eq", "fun": lambda x: float(surface.predict([x])[0]) - target}
    found = optimize.minimize(
        merit,
        start,
        bounds=[(-1, 1)] * len(start),
        constraints=[constraint],
        options={"ftol": 1e-12, "maxiter": 200},
    )
    hit = abs(float(surface.predict([found.x])[0]) - target) < 1e-5
    return found.x if hit and merit(found.x) <= merit(start) else start


def _nearest(surface, target, k, seed):
    starts = 2.0 * qmc.Sobol(k, seed=seed).random(256) - 1.0
    best = starts[np.argsort(np.abs(surface.predict(starts) - target))[:8]]
    fits = [
        optimize.minimize(
            lambda x: (float(surface.predict([x])[0]) - target) ** 2, s, bounds=[(-1, 1)] * k
        )
        for s in best
    ]
    return min(fits, key=lambda f: f.fun).x


@dataclass(frozen=True)
class Goal:
    """What is wanted of one response: 'target', 'maximise' or 'minimise' between low and high; weight shapes the
    ramp."""

    kind: str
    low: float
    high: float
    target: float | None = None
    weight: float = 1.0
    importance: float = 1.0

    def desirability(self, y):
        """0 to 1 of responses y (Derringer and Suich 1980, Journal of Quality Technology 12:214)."""
        y = np.asarray(y, float)
        if self.kind == "maximise":
            d = (y - self.low) / (self.high - self.low)
        elif self.kind == "minimise":
            d = (self.high - y) / (self.high - self.low)
        elif self.kind == "target":
            rising = (y - self.low) / (self.target - self.low)
            d = np.where(y <= self.target, rising, (self.high - y) / (self.high - self.target))
        else:
            raise CalibrationError(f"unknown goal {self.kind!r}; known: target, maximise, minimise")
        return np.clip(d, 0.0, 1.0) ** self.weight


def overall_desirability(surfaces, goals, points):
    """Geometric mean (n,) of the responses' desirabilities at points (n, factors), weighted by importance."""
    weight = np.array([g.importance for g in goals])
    each = np.array(
        [g.desirability(s.predict(points)) for s, g in zip(surfaces, goals, strict=True)]
    )
    with np.errstate(divide="ignore"):
        return np.exp((weight[:, None] * np.log(each)).sum(0) / weight.sum())


def most_desirable(surfaces, goals, seed=1):
    """Point (factors,) of the cube with the largest overall desirability, and that desirability."""
    k = len(surfaces[0].codes)
    starts = 2.0 * qmc.Sobol(k, seed=seed).random(CANDIDATES) - 1.0
    value = overall_desirability(surfaces, goals, starts)
    best = starts[np.argsort(-value)[:8]]
    fits = [
        optimize.minimize(
            lambda x: -float(overall_desirability(surfaces, goals, [x])[0]),
            s,
            bounds=[(-1, 1)] * k,
            method="Nelder-Mead",
        )
        for s in best
    ]
    winner = min(fits, key=lambda f: f.fun)
    return winner.x, -float(winner.fun)
