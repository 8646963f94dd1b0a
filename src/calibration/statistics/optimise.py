"""Solving response surfaces for a target: the whole set of solutions, and its point closest to the
centre."""

from dataclasses import dataclass

import numpy as np
import scipy

from calibration.statistics.surface import Surface
from calibration.statistics.ties import first_least

CANDIDATES = 4096
TOLERANCE = 1e-6  # of the target, or of 1 where the target is smaller


@dataclass(frozen=True)
class Solution:
    """Points (m, factors) in coded levels whose prediction is the target, the one that was chosen,
    and the set's extent: low and high (factors,)."""

    target: float
    attainable: bool
    chosen: np.ndarray
    predicted: float
    points: np.ndarray
    low: np.ndarray
    high: np.ndarray


def solve(surface: Surface, target: float, seed: int = 1) -> Solution:
    """All points of the cube [-1, 1]^k where `surface` predicts `target`, and the one of them that
    is closest to its centre.

    The set is a surface in the cube. It is sampled at the crossings with random lines through the
    cube. Its extent and the chosen point are then refined on the set itself. Where the target is
    out of reach, the point of nearest prediction is returned and `attainable` is False.
    """
    points = _crossings(surface, target, len(surface.codes), seed)
    if not len(points):
        # a set too small for the lines to meet: in a corner, on a face, or a stationary point
        points = _nearest(surface, target, seed)[None]
    attainable = bool(abs(surface.predict(points[:1])[0] - target) <= _tolerance(target))
    if not attainable:
        chosen = low = high = points[0]
    else:
        start = points[np.argmin(_from_centre(points))]
        chosen = _refine(surface, target, start, _from_centre)
        low, high = _extent(surface, target, points)
    predicted = float(surface.predict([chosen])[0])
    return Solution(target, attainable, chosen, predicted, points, low, high)


def _tolerance(target):
    return TOLERANCE * max(abs(target), 1.0)


def _from_centre(points):
    """Squared distance (n,) of points (n, factors) from the cube's centre."""
    return (points**2).sum(1)


def _crossings(surface, target, k, seed):
    """Points where chords of the cube cross the target; exact for a quadratic along a line.

    The chords run through pairs of quasi-random points from face to face, so that the set is met up
    to the faces."""
    pairs = 2.0 * scipy.stats.qmc.Sobol(2 * k, seed=seed).random(CANDIDATES) - 1.0
    a, b = _chord(pairs[:, :k], pairs[:, k:])
    fa, fm, fb = (surface.predict(p) - target for p in (a, 0.5 * (a + b), b))
    # f(t) = c2 t^2 + c1 t + c0 through t = 0, 1/2, 1
    c2, c1, c0 = 2 * fa - 4 * fm + 2 * fb, -3 * fa + 4 * fm - fb, fa
    discriminant = c1**2 - 4 * c2 * c0
    q = -0.5 * (c1 + np.copysign(np.sqrt(np.maximum(discriminant, 0.0)), c1))
    found = []
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        roots = (q / c2, c0 / q)  # the two roots without cancellation; c2 is 0 where f is linear
    for t in roots:
        ok = (discriminant >= 0.0) & np.isfinite(t) & (t >= 0.0) & (t <= 1.0)
        point = a[ok] + t[ok, None] * (b[ok] - a[ok])
        found.append(point[np.abs(surface.predict(point) - target) <= _tolerance(target)])
    return np.concatenate(found)


def _chord(a, b):
    """Ends (n, k) on the cube's faces of the lines through a and b (n, k), both inside."""
    direction = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        forward = np.min(
            (np.sign(direction) - a) / direction, axis=1, where=direction != 0, initial=np.inf
        )
        back = np.min(
            (np.sign(direction) + a) / direction, axis=1, where=direction != 0, initial=np.inf
        )
    return a - back[:, None] * direction, a + forward[:, None] * direction


def _refine(surface, target, start, merit):
    """The point of least merit on the solution set, searched from `start`, which is kept where that
    fails."""
    found = scipy.optimize.minimize(
        lambda x: float(merit(x[None])[0]),
        start,
        method="SLSQP",
        bounds=[(-1, 1)] * len(start),
        constraints=[{"type": "eq", "fun": lambda x: float(surface.predict([x])[0]) - target}],
        options={"ftol": 1e-12, "maxiter": 200},
    )
    point = np.clip(found.x, -1.0, 1.0)
    hit = abs(float(surface.predict([point])[0]) - target) <= 10 * _tolerance(target)
    return point if hit and merit(point[None])[0] <= merit(start[None])[0] else start


def _extent(surface, target, points):
    """(low, high), (factors,) each, of the solution set, refined from the sample's own extremes."""
    low, high = points.min(0), points.max(0)
    for i in range(points.shape[1]):
        for end, sign in ((low, 1.0), (high, -1.0)):
            start = points[np.argmin(sign * points[:, i])]
            end[i] = _refine(surface, target, start, lambda x, i=i, s=sign: s * x[:, i])[i]
    return low, high


def _nearest(surface, target, seed):
    """The point of the cube (factors,) whose prediction is nearest to the target."""

    def off(x):
        return (float(surface.predict([x])[0]) - target) ** 2

    k, options = len(surface.codes), {"ftol": 1e-15, "gtol": 1e-12}
    starts = 2.0 * scipy.stats.qmc.Sobol(k, seed=seed).random(256) - 1.0
    best = starts[np.argsort(np.abs(surface.predict(starts) - target))[:8]]
    fits = [scipy.optimize.minimize(off, s, bounds=[(-1, 1)] * k, options=options) for s in best]
    return fits[first_least([f.fun for f in fits])].x
