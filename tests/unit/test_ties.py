"""What is chosen does not hang on the last digit: inputs that move by a rounding error, as another
processor's linear algebra does, give the same choice."""

import numpy as np
import pandas as pd
import pytest

from calibration.chain.joint.analysis import medoid
from calibration.statistics.screening import screen, significant
from calibration.statistics.ties import first_largest, first_least, largest_first


def moved(values, seed):
    """Values off by at most two units in the last place."""
    sign = np.random.default_rng(seed).integers(-4, 5, np.shape(values))
    return np.asarray(values, float) * (1.0 + sign * 2.0**-53)


def always_the_same(choose, tries=20):
    """The one choice of every try; choose: seed -> choice."""
    found = {choose(seed) for seed in range(tries)}
    assert len(found) == 1, found
    return found.pop()


def test_the_first_of_equal_numbers_is_chosen():
    values = [1.0, 3.0, 2.0, 3.0, 1.0]
    assert always_the_same(lambda s: first_largest(moved(values, s))) == 1
    assert always_the_same(lambda s: first_least(moved(values, s))) == 0
    order = always_the_same(lambda s: tuple(map(int, largest_first(moved(values, s)))))
    assert order == (1, 3, 2, 0, 4)
    assert first_largest([-np.inf, 0.0, -np.inf]) == 1
    assert list(largest_first([1.0, 1.0 + 1e-6])) == [1, 0]


def test_the_middle_of_mirrored_draws_is_the_first_of_them():
    along = np.linspace(0.0, 1.2, 41)
    arc = np.column_stack([np.cos(along), np.sin(along)])
    a = always_the_same(lambda s: round(arc[medoid(moved(arc, s))][0], 12))
    b = always_the_same(lambda s: round(arc[::-1][medoid(moved(arc[::-1], s))][0], 12))
    # mirrored at the bisector: of the two that tie each order has its own first one
    assert np.arccos(a) + np.arccos(b) == pytest.approx(1.2)


def test_factors_of_equal_effect_go_on_in_their_order():
    levels = np.array([[1, -1][k >> j & 1] for k in range(8) for j in range(3)]).reshape(8, 3)
    design = pd.DataFrame(levels, columns=list("ABC"))
    noise = 0.01 * levels.prod(axis=1)
    response = 30.1 + 0.1 * levels[:, 2] + 0.7 * levels[:, 0] - 0.7 * levels[:, 1] + noise

    def chosen(seed):
        found = screen(design, list("ABC"), moved(response, seed))
        scores = found.table["half_normal_score"]
        return (*significant(found, 0.05), bool(scores[0] < scores[1]))

    assert always_the_same(chosen) == ("A", "B", "C", True)
