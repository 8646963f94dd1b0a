"""The two tests that decide whether anything is wrong share their chance of a false alarm."""

import numpy as np
import pytest
from scipy.stats import norm

from diagnosis.identify import significant


@pytest.mark.parametrize("alike", [0.0, 0.5, 0.95])
def test_false_alarms_are_as_many_as_stated_however_alike_the_tests_are(alike):
    rng = np.random.default_rng(1)
    n = 40_000
    common, own = rng.standard_normal((2, n)), rng.standard_normal((2, n))
    both = norm.sf(np.sqrt(alike) * common[0] + np.sqrt(1.0 - alike) * own)
    alarms = np.mean([any(significant(*p, 0.05)) for p in both.T])
    assert 0.03 < alarms < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / n)
