"""Laboratories whose truth is known: several responses of one to eight parameters, six kinds of
truth.

u in [0, 1]^d. A response is a plane over them and what its kind adds; runs and readings scatter
alike, as grains do.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.likelihood import Joint, Response
from calibration.inference.posterior_sampling import Prior
from calibration.statistics.design import space_filling

KINDS = ("plane", "curved", "step", "two kinds", "inert factors", "scatter that triples")
SCATTER = 0.3  # of a run about the mean; a response spans about 2
READINGS = 8


def uniform(d):
    """The flat prior of d parameters."""
    return Prior(np.full(d, 0.5), np.full(d, np.inf))


class Linear:
    """An emulator that is right: the mean is a + b u, with a stated error and scatter."""

    def __init__(self, b, a=0.0, error=0.0, scatter=0.0):
        self.a, self.b, self.error, self.sd = a, np.asarray(b, float), error, scatter

    def mean(self, u):
        return self.a + u @ self.b, np.full(len(u), self.error**2)

    def sd_of_run(self, u):
        return np.full(len(u), self.sd)


@dataclass(frozen=True)
class World:
    """`kind` of truth over d parameters with as many responses, at most three."""

    kind: str
    d: int
    seed: int

    @property
    def responses(self):
        return min(self.d, 3)

    @property
    def weights(self):
        """(responses, d) slopes; the last two thirds of inert factors have none."""
        w = np.random.default_rng([self.seed, 7]).normal(size=(self.responses, self.d))
        if self.kind == "inert factors":
            w[:, max(1, self.d // 3) :] = 0.0
        return 2.0 * w / np.abs(w).sum(axis=1, keepdims=True)

    def draws(self, k, u, rng):
        """(n,) runs of response k at u (n, d)."""
        u = np.atleast_2d(u)
        plane, first = u @ self.weights[k], u[:, k % self.d]
        sd = np.full(len(u), SCATTER)
        if self.kind == "curved":
            plane = plane + 0.6 * np.sin(3.0 * first) + (first - 0.3) ** 2
        if self.kind == "step":
            plane = plane + (first > 0.55)
        if self.kind == "two kinds":
            plane = plane + 1.0 * (rng.random(len(u)) < expit(6.0 * (first - 0.5)))
        if self.kind == "scatter that triples":
            sd = sd * 3.0**first
        return rng.normal(plane, sd)

    def trained(self, rng, scrambled=1):
        """Emulators of the responses: a space-filling design, a third of its points run twice."""
        n = 30 + 10 * self.d
        x = space_filling(n, self.d, scrambled)
        x = np.concatenate([x, x[: n // 3]])
        return [GaussianProcess().fit(x, self.draws(k, x, rng)) for k in range(self.responses)]

    def study(self, truth, emulators, rng):
        """`Joint` of `READINGS` readings of each response at the true parameters (d,)."""
        found = []
        for k, emulator in enumerate(emulators):
            y = self.draws(k, np.repeat(truth[None], READINGS, axis=0), rng)
            se2 = y.var(ddof=1) / READINGS
            found.append(Response(f"response {k}", emulator, y.mean(), se2, READINGS - 1))
        return Joint(tuple(found), uniform(self.d))
