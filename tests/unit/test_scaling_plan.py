"""Run specs enlarged by a rule, and the engine's own exponents."""

import numpy as np
import pytest
import yaml

from calibration.chain.study import Study
from calibration.runs.plans import read_plan
from calibration.stages.scaling import (
    DROPS,
    base_run,
    enlarged,
    measured_exponents,
    plan_scaling,
    quantity_of,
)
from calibration.statistics.dimensions import (
    GRAVITY_RULE,
    PAPER_RULE,
    RULES,
    ScalingError,
    exponents,
)
from calibration.study.config import parse_config
from dem.spec import GEOMETRY, LawParameters, Numerics, Particles
from facts import refused
from stage_files import PlanFiles

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
    assert {k for k in unscaled if quantity_of(k) is None} <= bare


@pytest.mark.parametrize("rule", RULES.values(), ids=list(RULES))
def test_an_enlarged_run_has_the_factors_of_its_rule(rule):
    one, two = (enlarged(HEAP, "heap", rule, h) for h in (1, 2))
    power = {q: 2.0 ** float(a) for q, a in exponents(rule.held).items()}
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
        found, stated = measured_exponents(runs), exponents(rule.held)
        for quantity in ("mass", "force", "stiffness", "damping_coefficient"):
            assert found[quantity] == pytest.approx(float(stated[quantity]), abs=1e-3)
        assert found["weight"] == pytest.approx(3.0, abs=1e-3)
    assert np.isclose(float(exponents(GRAVITY_RULE.held)["force"]), 3.0)
