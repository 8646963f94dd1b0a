"""A choice between two words, such as two laws of rolling friction, as a factor of a screening."""

import numpy as np
import pytest

from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.runs.feasibility import check_ahead
from calibration.stages.screening import _going_on
from calibration.statistics.design import screening_design
from calibration.statistics.screening import screen
from calibration.study.factors import Choice, read_factors
from facts import refused
from made_up import made_up
from small_heap import RUN

FACTORS = {
    "restitution": ("contacts.particle_wall.restitution", 0.4, 0.8),
    "modulus": ("materials.particle.shear_modulus_Pa", 1e7, 2e7),
    "damping_law": ("laws.damping", "tsuji", "thornton"),
}
MEASURED = """experiment,quantity,value,unit,drop_height_mm
drop,rebound_height,52,mm,150
drop,rebound_height,54,mm,150
"""
FIXED = {"restitution": 0.6, "modulus": 1e7, "damping_law": "tsuji"}


@pytest.fixture
def study(tmp_path, monkeypatch):
    """make(**changes): configuration of a screening of drops with a choice of the damping law."""
    rig = {"particles": {"diameter_mm": 4.0}, "geometry": {"drops": 1, "drop_height_mm": 150.0}}
    run = {"materials": RUN["materials"], "contacts": RUN["contacts"]} | rig

    def make(**changes):
        data = {
            "tests": {"ball": {"experiment": "drop"}},
            "screening": {"centre_runs": 2},
            "calibrate": {"to": "rebound_height_mm"},
            "fixed": FIXED,
            "run": run,
        }
        return made_up(tmp_path, monkeypatch, FACTORS, MEASURED, **data | changes)  # fmt: skip

    return make


def test_words_in_the_table_are_a_choice(study):
    *numbers, choice = read_factors(study().factors)
    assert not any(isinstance(f, Choice) for f in numbers)
    assert choice.words == ("tsuji", "thornton")
    assert [choice.value(choice.natural(x)) for x in (-1.0, 0.0, 1.0)] == [
        "tsuji",
        "tsuji",
        "thornton",
    ]
    with refused(ConfigError, key="damping_law", value="hertz", allowed="tsuji or thornton"):
        choice.value("hertz")


@pytest.mark.parametrize("kind", ["resolution_iv", "plackett_burman"])
def test_each_run_has_one_of_the_two_laws(study, kind):
    rules = {"kind": kind, "centre_runs": 2 if kind == "resolution_iv" else 0}
    config = study(screening=rules)
    check_ahead(config)
    factors = read_factors(config.factors)
    table, specs = Study(config).plan(screening_design(factors, config.screening))
    for row in table.to_dict("records"):
        law = specs[row["run_id"]]["laws"]["damping"]
        assert law == {-1.0: "tsuji", 1.0: "thornton"}[row["C"]]
    assert set(table["C"]) == {-1.0, 1.0}


def test_its_effect_is_that_of_the_runs_and_it_does_not_go_on(study):
    """A law has no direction to go in, however large its effect."""
    config = study()
    factors = read_factors(config.factors)
    table, _ = Study(config).plan(screening_design(factors, config.screening))
    scatter = np.random.default_rng(3).normal(0, 0.1, len(table))
    response = 40.0 + 4.0 * table["A"] + 6.0 * table["C"] + scatter
    found = screen(table, ["A", "B", "C"], response, 0.05)
    # the runs at the centre have the first law
    corners = table["A"] != 0.0
    low, high = (response[corners & (table["C"] == s)].mean() for s in (-1.0, 1.0))
    assert found.table.set_index("code")["effect"]["C"] == pytest.approx(high - low, abs=1.0)
    codes, _ = _going_on(config, factors, found)
    assert "C" not in codes
    assert "A" in codes


@pytest.mark.parametrize(
    ("changes", "facts"),
    [
        (
            {"fixed": {"restitution": 0.6, "modulus": 1e7, "damping_law": 1.0}},
            {"key": "fixed.damping_law", "value": 1.0, "allowed": "tsuji or thornton"},
        ),
        ({"screening": {"go_on": ["damping_law", "restitution"]}}, {"key": "damping_law"}),
    ],
)
def test_a_choice_where_a_number_is_needed_is_refused(study, changes, facts):
    with refused(ConfigError, **facts):
        study(**changes)


def test_a_choice_needs_a_word_for_the_stages_after_the_screening(study):
    config = study(fixed={"restitution": 0.6, "modulus": 1e7}, screening={"at_least": 1})
    with refused(ConfigError, key="fixed.damping_law", allowed="a level of it: tsuji or thornton"):
        check_ahead(config)
