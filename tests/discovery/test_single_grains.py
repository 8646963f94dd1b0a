"""The cases of single grains are a plan."""

from collections import Counter

from benchmarks.rates import single_grains


def test_each_mechanism_is_planned_once_at_each_point_with_and_without_its_entry():
    cases = single_grains.planned()
    hidden = Counter((c.case, c.truth) for c in cases if c.truth)
    assert set(hidden.values()) == {single_grains.POINTS}
    assert {c.truth for c in cases if c.truth} == set(single_grains.strengths())
    assert len(set(cases)) == len(cases) == 84
