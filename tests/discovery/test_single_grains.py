"""The table of single grains is that of the kept cases of the present engine and rules."""

from collections import Counter

import kept_rates
import single_grains


def test_each_mechanism_is_planned_once_at_each_point_with_and_without_its_entry():
    cases = single_grains.planned()
    hidden = Counter((c.case, c.truth) for c in cases if c.effects)
    assert set(hidden.values()) == {single_grains.POINTS}
    assert {c.truth for c in cases if c.effects} <= set(single_grains.strengths())
    assert len(set(cases)) == len(cases)


def test_the_page_shows_the_kept_cases():
    shown = kept_rates.shown(single_grains.PAGE, single_grains.MARK)
    assert shown == single_grains.kept_table()
