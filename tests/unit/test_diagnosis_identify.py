"""The two tests that decide whether anything is wrong share their chance of a false alarm."""

import numpy as np
import pytest
from scipy.stats import norm

from diagnosis.identify import significant


@pytest.mark.parametrize(
    ("misfit", "gain", "expected"),
    [
        (0.6, 0.7, (False, False)),
        (0.04, 0.7, (False, False)),
        (0.02, 0.7, (True, False)),
        (0.7, 0.02, (False, True)),
        (0.04, 0.04, (True, True)),
        (0.001, 0.04, (True, True)),
        (0.001, 0.06, (True, False)),
    ],
)
def test_both_below_the_level_or_one_below_half_of_it(misfit, gain, expected):
    assert significant(misfit, gain, 0.05) == expected


@pytest.mark.parametrize("alike", [0.0, 0.5, 0.95])
def test_false_alarms_are_as_many_as_stated_however_alike_the_tests_are(alike):
    rng = np.random.default_rng(1)
    n = 40_000
    common, own = rng.standard_normal((2, n)), rng.standard_normal((2, n))
    both = norm.sf(np.sqrt(alike) * common[0] + np.sqrt(1.0 - alike) * own)
    alarms = np.mean([any(significant(*p, 0.05)) for p in both.T])
    assert 0.03 < alarms < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / n)
