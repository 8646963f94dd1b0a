"""The solution set is whole, its extent is true, and the chosen point obeys its rule."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from calibration.statistics.goals import RULES, Goal, overall_desirability
from calibration.statistics.optimise import most_desirable, solve


@dataclass
class Known:
    """A response surface given by its formula."""

    codes: str
    formula: object

    def predict(self, levels):
        return self.formula(*np.atleast_2d(np.asarray(levels, float)).T)

    def standard_error(self, levels):
        x = np.atleast_2d(np.asarray(levels, float))
        return np.sqrt(0.1 + ((x - 0.9) ** 2).sum(1))


PLANE = Known("AB", lambda a, b: 1.0 + a + 0.5 * b)
BALL = Known("ABC", lambda a, b, c: a**2 + b**2 + c**2)
SADDLE = Known("ABC", lambda a, b, c: 45 + 2 * a - b + 0.5 * c + a * b - b**2 + 0.3 * c**2)


@pytest.mark.parametrize("surface", [PLANE, BALL, SADDLE])
def test_extent_agrees_with_a_search_of_the_whole_cube(surface):
    k, n = len(surface.codes), 81
    grid = np.array(list(product(np.linspace(-1, 1, n), repeat=k)))
    values = surface.predict(grid)
    target = float(np.quantile(values, 0.35))
    solution = solve(surface, target)
    assert np.allclose(surface.predict(solution.points), target, atol=1e-4)
    # between neighbours of the grid the response crosses the target somewhere
    cube = values.reshape([n] * k) - target
    for axis, (low, high) in enumerate(zip(solution.low, solution.high, strict=True)):
        crossed = set()
        for other in range(k):
            first, last = (
                np.split(np.moveaxis(cube, other, 0), [-1])[0],
                np.moveaxis(cube, other, 0)[1:],
            )
            hits = np.argwhere(first * last <= 0)
            order = [other, *(i for i in range(k) if i != other)]
            crossed |= {int(h[order.index(axis)]) for h in hits}
        line = np.linspace(-1, 1, n)
        assert low == pytest.approx(line[min(crossed)], abs=2.5 / n)
        assert high == pytest.approx(line[min(max(crossed) + 1, n - 1)], abs=5 / n)


def test_the_closest_point_of_a_plane_is_the_foot_of_its_normal():
    # distance of the line a + b/2 = 0.2 from the centre, along (1, 1/2)
    solution = solve(PLANE, 1.2)
    assert solution.attainable
    assert solution.chosen == pytest.approx(np.array([1.0, 0.5]) * 0.2 / 1.25, abs=1e-6)


@pytest.mark.parametrize("rule", RULES)
def test_no_sampled_point_is_better_than_the_chosen_one(rule):
    point = np.array([0.3, -0.2, 0.1])
    solution = solve(SADDLE, 44.5, rule, point=point)
    merit = {
        "closest_to_centre": lambda x: (x**2).sum(1),
        "closest_to_point": lambda x: ((x - point) ** 2).sum(1),
        "smallest_prediction_variance": SADDLE.standard_error,
    }[rule]
    assert merit(solution.chosen[None])[0] <= merit(solution.points).min() + 1e-9
    assert solution.predicted == pytest.approx(44.5, abs=1e-3)


def test_a_target_out_of_reach_gives_the_nearest_corner():
    solution = solve(PLANE, 3.0)
    assert not solution.attainable
    assert solution.chosen == pytest.approx([1.0, 1.0], abs=1e-6)
    assert solution.predicted == pytest.approx(2.5, abs=1e-6)


def test_desirability_has_derringer_and_suichs_values():
    target = Goal(40, 50, 46)
    assert target.desirability([39, 43, 46, 48, 51]) == pytest.approx([0, 0.5, 1, 0.5, 0])
    # 0.25 and 0.75
    low, high = Known("A", lambda a: 1.0 + 0 * a), Known("A", lambda a: 5.0 + 0 * a)
    both = overall_desirability([low, high], [Goal(0, 8, 4)] * 2, [[0.0]])
    assert both[0] == pytest.approx((0.25 * 0.75) ** 0.5)


def test_several_responses_meet_where_both_are_met():
    # a = 0.5 gives the first target, b = -0.25 the second
    first, second = Known("AB", lambda a, b: 10 + 4 * a), Known("AB", lambda a, b: 5 - 4 * b)
    goals = [Goal(8, 14, 12), Goal(3, 9, 6)]
    point, value = most_desirable([first, second], goals)
    assert point == pytest.approx([0.5, -0.25], abs=1e-3)
    assert value == pytest.approx(1.0, abs=1e-3)
