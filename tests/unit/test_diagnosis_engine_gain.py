"""Which settings are run with a law that single contacts show."""

import numpy as np
import pytest

from diagnosis.laws.engine_gain import MOST_SETTINGS, some_of


@pytest.mark.parametrize(
    ("levels", "size", "run"), [(6, 5, 12), (3, 2, 6), (5, 4, 10), (30, 1, 12), (4, 30, 12)]
)
def test_a_dozen_settings_are_run_spread_over_the_levels(levels, size, run):
    given = [np.arange(k * size, (k + 1) * size) for k in range(levels)]
    some = some_of(given)
    assert sum(map(len, some)) == run <= MOST_SETTINGS
    assert all(set(s) <= set(g) for s, g in zip(some, given, strict=True))
    # no level has two more than another, and single settings reach both ends
    assert max(map(len, some)) - min(map(len, some)) <= 1
    assert len(some[0])
    assert len(some[-1])
    if size > 2 and levels > 2:  # each place within a level has its turn
        assert len({int(i) % size for s in some for i in s}) > max(map(len, some))
