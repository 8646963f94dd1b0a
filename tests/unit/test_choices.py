"""A choice between two words, such as two laws of rolling friction, as a factor of a screening."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.runs.feasibility import check_ahead
from calibration.stages.screening import _going_on
from calibration.statistics.screening import screen
from calibration.statistics.screening_design import screening_design
from calibration.study.config import parse_config
from calibration.study.factors import Choice, read_factors
from facts import refused

ROOT = Path(__file__).parents[2]
HEAD = "code\tname\tkey\tlow\thigh\tdescription\n"
RESTITUTION = "A\trestitution\tcontacts.particle_wall.restitution\t0.4\t0.8\tof the floor\n"
MODULUS = "B\tmodulus\tmaterials.particle.shear_modulus_Pa\t1e7\t2e7\tof the grain\n"
LAW = "C\tdamping_law\tlaws.damping\ttsuji\tthornton\thow energy is lost\n"


@pytest.fixture
def study(tmp_path, monkeypatch):
    """make(**changes): configuration of a screening of drops with a choice of the damping law."""
    monkeypatch.chdir(tmp_path)
    for name in ("config", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "factors.tsv").write_text(HEAD + RESTITUTION + MODULUS + LAW)
    salt = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    run = {key: salt["run"][key] for key in ("materials",)}
    own = {"restitution": 0.6, "static_friction": 0.5, "rolling_friction": 0.1}
    run |= {
        "materials": {
            "particle": {"density_kg_m3": 2100, "shear_modulus_Pa": 1e7, "poisson_ratio": 0.2},
            "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 1e9, "poisson_ratio": 0.3},
        },
        "contacts": {"particle_particle": own, "particle_wall": own},
        "particles": {"diameter_mm": 4.0},
        "geometry": {"drops": 1, "drop_height_mm": 150.0},
    }

    def make(**changes):
        data = {
            "name": "laws",
            "factors": "factors.tsv",
            "tests": {"ball": {"experiment": "drop"}},
            "calibrate": {"to": {"rebound_height_mm": {}}},
            "measurements": salt["measurements"],
            "screening": {"centre_runs": 2},
            "fixed": {"restitution": 0.6, "modulus": 1e7, "damping_law": "tsuji"},
            "run": run,
        }
        return parse_config(data | changes)

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
