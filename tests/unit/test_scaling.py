from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.statistics.dimensions import (
    DIMENSIONS,
    GRAVITY_RULE,
    PAPER_RULE,
    OverdeterminedError,
    UnderdeterminedError,
    exponent,
    exponents,
    factors,
    group_exponents,
    independent,
    settings_of,
)
from facts import refused


def broken(settings):
    table = group_exponents(settings)
    return {name.split()[0] for name in table.group[~table.kept]}


def test_paper_rule_gives_its_own_equations():
    rule = PAPER_RULE.held
    assert exponent("mass", rule) == 3  # Eq. 5
    assert exponent("force", rule) == 2  # Eq. 6
    assert exponent("modulus", rule) == 0  # Eq. 8
    assert exponent("stiffness", rule) == 1
    assert exponent("time", rule) == 1
    assert exponent("acceleration", rule) == -1


def test_gravity_rule_is_froude_scaling():
    rule = GRAVITY_RULE.held
    assert exponent("time", rule) == Fraction(1, 2)
    assert exponent("velocity", rule) == Fraction(1, 2)
    assert exponent("force", rule) == 3
    assert exponent("modulus", rule) == 1
    assert exponent("surface_energy", rule) == 2
    assert factors(rule, 4.0)["velocity"] == pytest.approx(2.0)


def test_equation_4_contradicts_itself_and_the_conflict_is_named():
    with refused(OverdeterminedError, "density", "h^-2") as error:
        exponent("force", {"length": 1, "mass": 1, "density": 0})
    assert set(error.value.conflict) == {"length", "mass", "density"}


@settings(deadline=None)
@given(
    a=st.tuples(*[st.fractions(min_value=-2, max_value=2, max_denominator=4)] * 3),
    held=st.lists(st.sampled_from(sorted(DIMENSIONS)), min_size=3, max_size=6, unique=True),
)
def test_exponents_are_those_of_the_units_they_were_made_from(a, held):
    """Any consistent change of units is recovered from any quantities of independent dimensions."""
    truth = {
        q: sum(p * e for p, e in zip(powers, a, strict=True)) for q, powers in DIMENSIONS.items()
    }
    given_ = {q: truth[q] for q in held}
    if independent(held) == 3:
        assert exponents(given_) == truth
    else:
        with pytest.raises(UnderdeterminedError):
            exponents(given_)


def test_what_the_paper_rule_breaks_under_real_gravity_and_surface_energy():
    assert broken(settings_of(PAPER_RULE, ("acceleration",))) == {
        "Froude",
        "weight",
        "Bond",
        "cohesion",
    }
    assert "adhesion" in broken(settings_of(PAPER_RULE, ("acceleration", "surface_energy")))


def test_what_the_gravity_rule_breaks_when_materials_or_rig_are_kept():
    assert broken(settings_of(GRAVITY_RULE, ("surface_energy",))) == {"Bond", "adhesion"}
    assert broken(settings_of(GRAVITY_RULE, ("rig_length",))) == {"particle"}
    assert broken(settings_of(GRAVITY_RULE, ("modulus",))) == {"relative", "weight", "adhesion"}
    assert broken(settings_of(GRAVITY_RULE, ("rolling_length",))) == {"rolling-resistance"}


def test_restitution_does_not_follow_the_radius():
    """That of a linear contact goes with c / (2 sqrt(k m)) alone."""
    c, k, m = (exponent(q, PAPER_RULE.held) for q in ("damping_coefficient", "stiffness", "mass"))
    assert c == 2
    assert c - (k + m) / 2 == 0
