"""The verdict on one trial: the mean difference of paired runs, its interval, and the margin."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

LEVEL = 0.95
"""Of all intervals together: Bonferroni's share of it for each."""

SAME, ALIKE, DIFFERENT, UNKNOWN = "within", "not apart", "different", "no value"


@dataclass(frozen=True)
class Verdict:
    """What a trial came to, in the unit of its metric.

    pairs, lost : runs of which both engines have a value, and those of which one has none alone
    old, new : means
    difference, half : new less old, and half of its interval
    margin : that of the trial
    outcome : SAME where the interval lies within the margin; DIFFERENT where it lies outside, or
        where more runs have no value than chance gives; ALIKE where it reaches over the margin, so
        that a difference beyond it is not shown; UNKNOWN with fewer than two pairs
    """

    pairs: int
    lost: tuple
    old: float
    new: float
    difference: float
    half: float
    margin: float
    outcome: str

    @property
    def accepted(self) -> bool:
        """Whether the engines may count as one by this trial."""
        return self.outcome in (SAME, ALIKE)


def judge(old: ArrayLike, new: ArrayLike, margin: float, relative: bool, trials: int) -> Verdict:
    """`Verdict` of the values (n,) of both engines, nan where a run has none, seed by seed.

    The interval is Student's of the paired differences at 1 - (1 - LEVEL) / trials.
    """
    old, new = np.asarray(old, float), np.asarray(new, float)
    both = np.isfinite(old) & np.isfinite(new)
    lost = (
        int((np.isfinite(new) & ~np.isfinite(old)).sum()),
        int((np.isfinite(old) & ~np.isfinite(new)).sum()),
    )
    if both.sum() < 2:
        nan = math.nan
        return Verdict(int(both.sum()), lost, nan, nan, nan, nan, margin, UNKNOWN)
    apart = (new - old)[both]
    mean, count = float(apart.mean()), len(apart)
    quantile = stats.t.ppf(1.0 - 0.5 * (1.0 - LEVEL) / trials, count - 1)
    half = float(quantile * apart.std(ddof=1) / math.sqrt(count))
    allowed = margin * abs(float(old[both].mean())) if relative else margin
    if abs(mean) - half > allowed or _losses_differ(lost, trials):
        outcome = DIFFERENT
    elif abs(mean) + half <= allowed:
        outcome = SAME
    else:
        outcome = ALIKE
    means = float(old[both].mean()), float(new[both].mean())
    return Verdict(count, lost, *means, mean, half, allowed, outcome)


def _losses_differ(lost, trials):
    """McNemar's exact test of the runs that one engine alone has no value of."""
    if not sum(lost):
        return False
    p = stats.binomtest(lost[1], sum(lost), 0.5).pvalue
    return bool(p < (1.0 - LEVEL) / trials)
