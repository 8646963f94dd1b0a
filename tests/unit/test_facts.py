"""The helpers that pin a fact fail where the fact is wrong."""

import pytest

from dem.errors import SpecError
from facts import holds, refused, tells


def test_a_name_is_held_whole():
    assert holds("a.b_c = 10", "b_c")
    assert not holds("a.b_c = 10", "1")
    assert not holds("6.6 kPa", "6")


def test_facts_must_stand_in_one_sentence():
    text = "The heap is 25.7 mm high.\nIt is\n30 ° steep."
    assert tells(text, "30 °", "steep")
    assert not tells(text, "25.7 mm", "steep")


@pytest.mark.parametrize("wrong", [{"key": "other"}, {"value": 2.0}, {"allowed": "more"}])
def test_a_wrong_fact_fails(wrong):
    def refuse(*names, **facts):
        with refused(SpecError, *names, **facts):
            raise SpecError("particles.count", 1.0, "less", "a/run.yaml")

    refuse("particles.count", key="particles.count", value=1.0, allowed="less", file="run.yaml")
    with pytest.raises(AssertionError):
        refuse(**wrong)
    with pytest.raises(AssertionError):
        refuse("grains")
