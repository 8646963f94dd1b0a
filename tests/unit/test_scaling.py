"""Scaling: exponents by dimensions, run specs enlarged by a rule, and the verdicts of the study."""

from fractions import Fraction

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.chain.study import Study
from calibration.runs.plans import read_plan
from calibration.stages.scaling import (
    DROPS,
    FAILS,
    HOLDS,
    UNDECIDED,
    base_run,
    enlarged,
    exponent_statements,
    log_slope,
    measured_exponents,
    plan_scaling,
    response_statements,
    response_table,
    scaling_figure,
)
from calibration.statistics.dimensions import (
    DIMENSIONS,
    GRAVITY_RULE,
    HELD_IN,
    PAPER_RULE,
    RULES,
    ScalingError,
    exponent,
    exponents,
    factors,
    group_exponents,
)
from calibration.statistics.numbers import fixed
from calibration.study.config import parse_config
from dem.spec import GEOMETRY, LawParameters, Numerics, Particles
from dem.units import unit_of
from facts import refused, tells
from stage_files import PlanFiles


def broken(rule, *unscaled):
    """Groups that a rule breaks where some quantities keep their value, whatever it asks for."""
    table = group_exponents(exponents(rule) | dict.fromkeys(unscaled, Fraction(0)))
    return {name.split()[0] for name in table.group[~table.kept]}


def test_gravity_rule_is_froude_scaling():
    rule = GRAVITY_RULE
    assert exponent("time", rule) == Fraction(1, 2)
    assert exponent("velocity", rule) == Fraction(1, 2)
    assert exponent("force", rule) == 3
    assert exponent("modulus", rule) == 1
    assert exponent("surface_energy", rule) == 2
    assert factors(rule, 4.0)["velocity"] == pytest.approx(2.0)


def test_equation_4_contradicts_itself():
    with refused(ScalingError, "length", "mass", "density"):
        exponent("force", {"length": 1, "mass": 1, "density": 0})


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
    if np.linalg.matrix_rank([DIMENSIONS[q] for q in held]) == 3:
        assert exponents(given_) == truth
    else:
        with pytest.raises(ScalingError):
            exponents(given_)


def test_what_the_paper_rule_breaks_under_real_gravity_and_surface_energy():
    assert broken(PAPER_RULE, "acceleration") == {
        "Froude",
        "weight",
        "Bond",
        "cohesion",
    }
    assert "adhesion" in broken(PAPER_RULE, "acceleration", "surface_energy")


def test_what_the_gravity_rule_breaks_when_materials_or_rig_are_kept():
    assert broken(GRAVITY_RULE, "surface_energy") == {"Bond", "adhesion"}
    assert broken(GRAVITY_RULE, "rig_length") == {"particle"}
    assert broken(GRAVITY_RULE, "modulus") == {"relative", "weight", "adhesion"}
    assert broken(GRAVITY_RULE, "rolling_length") == {"rolling-resistance"}


HEAP = {
    "laws": {"cohesion": "jkr"},
    "law_parameters": {"surface_energy_J_m2": 0.01},
    "particles": {"count": 500, "diameter_mm": 1.0},
    "geometry": {"orifice_diameter_mm": 5, "plate_diameter_mm": 20, "generation_rate_per_s": 1000},
}


@pytest.fixture
def config(repository):
    return parse_config(yaml.safe_load((repository / "config" / "config.yaml").read_text()))


@pytest.mark.parametrize("model", [LawParameters, Numerics, Particles, *GEOMETRY.values()])
def test_every_key_with_a_unit_is_known(model):
    """A new key of the run spec with a unit that the rules cannot read would be left unscaled in
    silence."""
    bare = {
        "count", "sizes", "scale_factor", "elongation", "clump",  # shares of the grain's size
        "liquid_volume_fraction", "wall_liquid_volume_fraction", "friction_exponent",
        "rolling_stiffness_factor",
        "rolling_damping_ratio", "plasticity_ratio", "tangential_stiffness_ratio",
        "meshes", "drops", "trials",
        "rayleigh_fraction", "precision", "rest_energy_ratio",
        "feed", "packing", "turns", "start_turns", "unconfined_strain", "taps", "skin",
        "skin_horizon", "overlap_limit",
    }  # fmt: skip
    # an angle and the shape that a file gives stay as they are at any scale; curves are refused
    alike = ("_angle_deg", "_stl")
    unscaled = {k for k in model.model_fields if not k.endswith(alike) and "_curve_" not in k}
    assert {k for k in unscaled if HELD_IN.get(unit_of(k)) is None} <= bare


@pytest.mark.parametrize("rule", RULES.values(), ids=list(RULES))
def test_an_enlarged_run_has_the_factors_of_its_rule(rule):
    one, two = (enlarged(HEAP, "heap", rule, h) for h in (1, 2))
    power = {q: 2.0 ** float(a) for q, a in exponents(rule).items()}
    for path, quantity in (
        (("particles", "diameter_mm"), "length"),
        (("geometry", "funnel_top_diameter_mm"), "rig_length"),
        (("geometry", "generation_rate_per_s"), "angular_velocity"),
        (("geometry", "injection_speed_m_s"), "velocity"),
        (("law_parameters", "surface_energy_J_m2"), "surface_energy"),
        (("numerics", "max_time_s"), "time"),
    ):
        ratio = two[path[0]][path[1]] / one[path[0]][path[1]]
        assert ratio == pytest.approx(power[quantity]), path
    assert two["particles"]["count"] == one["particles"]["count"]
    assert two["contacts"] == one["contacts"]
    assert two["output"] == one["output"]


@pytest.mark.parametrize(("slot", "law"), [("friction", "friction_curve"),
                                           ("damping", "restitution_curve")])  # fmt: skip
def test_a_law_as_a_curve_cannot_be_enlarged(slot, law):
    states = {f"{law}_low": 1.0, f"{law}_ratio": 4.0}
    curved = HEAP | {"laws": {slot: law}, "law_parameters": states}
    with refused(ScalingError, f"{law}_low"):
        enlarged(curved, "heap", PAPER_RULE, 2)


def test_the_plan_has_every_case_and_shares_what_is_equal(config, tmp_path):
    section = config.scaling
    plan_scaling(Study(config), None, PlanFiles.of(tmp_path))
    specs = read_plan(tmp_path / "plan.json").values()
    between, last = len(RULES) * (len(section.factors) - 2), len(RULES)
    assert len(specs) == 2 * (1 + between + last) * (section.seeds + DROPS)
    laws = {s["laws"]["cohesion"] for s in specs}
    assert laws == {"none", section.cohesion["laws"]["cohesion"]}


def test_the_study_s_own_cohesion_is_left_out(config):
    run = config.own_run | {
        "laws": {"cohesion": "sjkr"},
        "law_parameters": {"cohesion_energy_density_J_m3": 1e4},
    }
    plain = base_run(config.model_copy(update={"run": run}), "heap", False)
    assert plain["laws"]["cohesion"] == "none"
    assert not plain["law_parameters"]


def test_the_engine_s_exponents_are_those_of_the_dimensional_analysis(config):
    for rule in RULES.values():
        runs = {h: enlarged(base_run(config, "drop", False), "drop", rule, h) for h in (1, 2, 4)}
        found, stated = measured_exponents(runs), exponents(rule)
        for quantity in ("force", "stiffness", "damping_coefficient"):
            assert found[quantity] == pytest.approx(float(stated[quantity]), abs=1e-3)
    assert np.isclose(float(exponents(GRAVITY_RULE)["force"]), 3.0)


MARGINS = {"heap": 2.0, "drop": 0.02}
RIGHT = {"damping_coefficient": 2}


def heaps(shift, sd=0.5, n=8):
    """Angles at scales 1, 2 and 4 that fall by `shift` degrees a doubling."""
    rng = np.random.default_rng(2)
    rows = [(h, 45.0 - shift * np.log2(h) + sd * rng.normal()) for h in (1, 2, 4) for _ in range(n)]
    table = pd.DataFrame(rows, columns=["scale", "response"])
    return table.assign(experiment="heap", rule="paper", cohesive=True, left_in_funnel=0.0)


@pytest.mark.parametrize(
    ("shift", "sd", "verdict"), [(0.0, 0.5, HOLDS), (3.0, 0.5, FAILS), (0.0, 8.0, UNDECIDED)]
)
def test_a_planted_change_of_the_angle_is_found(shift, sd, verdict):
    runs = heaps(shift, sd)
    (statement,) = response_statements(runs, MARGINS)
    assert statement["verdict"] == verdict
    assert statement["low"] <= statement["found"] <= statement["high"]
    assert fixed(statement["found"], 1, "+") in statement["sentence"]


def test_the_table_has_the_mean_at_each_scale():
    table = response_table(heaps(3.0))
    assert table["mean"].tolist() == pytest.approx([45.0, 42.0, 39.0], abs=0.6)


@pytest.mark.parametrize("scales", [(1,), (2,), (2, 4), (1, 2, 4)])
def test_an_end_at_which_every_heap_clogs_leaves_it_undecided(scales):
    runs = heaps(3.0)
    runs["response"] = runs["response"].mask(runs["scale"].isin(scales))
    (statement,) = response_statements(runs, MARGINS)
    ends = {1, 4} & set(scales)
    assert (statement["found"] is None) == bool(ends)
    assert statement["verdict"] == (UNDECIDED if ends else FAILS)
    assert tells(statement["sentence"], f"{8 * len(scales)} of 24", "no value")
    table = response_table(runs)
    assert table["mean"].isna().tolist() == [h in scales for h in (1, 2, 4)]
    plt.close(scaling_figure(table.assign(experiment="heap")))


def test_exponents_decide_the_statements():
    for stiffness, verdict in ((1, FAILS), (2, HOLDS)):
        verdicts = {
            s["id"]: s["verdict"] for s in exponent_statements(RIGHT | {"stiffness": stiffness})
        }
        assert verdicts == {"section122.stiffness": verdict, "section122.damping": HOLDS}


def test_log_slope_of_a_power_law():
    scale = np.array([1.0, 1.0, 2.0, 2.0, 4.0, 4.0])
    noise = np.array([1.01, 0.99, 1.0, 1.01, 0.99, 1.0])
    found, low, high = log_slope(scale, 3.0 * scale**0.5 * noise)
    assert low < 0.5 < high
    assert found == pytest.approx(0.5, abs=0.02)
