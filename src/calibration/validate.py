"""Comparison of replicate runs at the optimum with the measurement: difference, interval, t test, equivalence test."""

from dataclasses import asdict, dataclass

import numpy as np
from scipy import stats


@dataclass(frozen=True)
class Comparison:
    """Simulated against measured; angles or any other unit."""

    simulated_mean: float
    simulated_sd: float
    simulated_n: int
    measured_mean: float
    measured_sd: float
    measured_n: int
    difference: float
    difference_low: float
    difference_high: float
    relative_error_percent: float
    t: float
    t_p: float
    margin: float
    equivalence_p: float
    equivalent: bool
    between_groups_sd: float
    within_groups_sd: float

    def as_dict(self):
        """Plain mapping for JSON."""
        return {k: (v.item() if isinstance(v, np.generic) else v) for k, v in asdict(self).items()}


def compare(simulated, measured, margin, alpha=0.05):
    """Compare simulated (groups, replicates) with measured (n,) values.

    The interval of the difference and the tests are Welch's, of unequal variances. The equivalence test is two
    one-sided tests against +-margin (Schuirmann 1987): its p is the larger of the two, below alpha means equivalent.
    """
    groups = np.asarray(simulated, float)
    s, m = groups.ravel(), np.asarray(measured, float).ravel()
    difference = float(s.mean() - m.mean())
    vs, vm = s.var(ddof=1) / len(s), m.var(ddof=1) / len(m)
    se = float(np.sqrt(vs + vm))
    df = (vs + vm) ** 2 / (vs**2 / (len(s) - 1) + vm**2 / (len(m) - 1))
    half = stats.t.ppf(1 - alpha / 2, df) * se
    t = difference / se
    one_sided = max(
        stats.t.sf((difference + margin) / se, df), stats.t.cdf((difference - margin) / se, df)
    )
    between, within = variance_components(groups)
    return Comparison(
        float(s.mean()), float(s.std(ddof=1)), len(s), float(m.mean()), float(m.std(ddof=1)), len(m),
        difference, difference - half, difference + half, 100.0 * abs(difference) / float(m.mean()),
        float(t), float(2 * stats.t.sf(abs(t), df)), margin, float(one_sided), bool(one_sided < alpha),
        between, within,
    )  # fmt: skip


def variance_components(groups):
    """Standard deviations between and within groups (g, r) by the method of moments; zero where negative."""
    groups = np.atleast_2d(groups)
    r = groups.shape[1]
    within = groups.var(axis=1, ddof=1).mean() if r > 1 else 0.0
    between = groups.mean(1).var(ddof=1) - within / r if len(groups) > 1 else 0.0
    return float(np.sqrt(max(between, 0.0))), float(np.sqrt(within))
