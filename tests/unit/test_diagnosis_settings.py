"""Settings of the diagnosis: laid over by a study, checked against the measurements, extended by a
folder."""

import pytest

from benchmarks.rates.simulated import salt_settings
from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement, MeasurementErrors
from calibration.study.config.schema import Config
from diagnosis.settings import check_levers, parameters_of, study_settings
from diagnosis.setup import completed
from facts import refused


def drop(height, line, **levers):
    return Measurement("drop", 0.2 * height, 1.0, 5, {"drop_height_mm": height, **levers}, "", line)


def test_changes_are_laid_over_key_by_key_and_a_null_takes_one_away():
    plain = salt_settings()
    changed = salt_settings(
        {
            "experiments": {
                "shear": {"metric": "other"},
                "drop": {"levers": {"particle_diameter_mm": None}},
            }
        }
    )
    assert changed.experiments["shear"].metric == "other"
    assert changed.experiments["shear"].run == plain.experiments["shear"].run
    assert list(changed.experiments["drop"].levers) == ["drop_height_mm"]


@pytest.mark.parametrize(
    ("kind", "own", "name"),
    [
        ("drop", {"levers": {"drop_height_mm": [2, 1]}}, "0 < low < high"),
        ("tilt", {"held": {"tilt_rate_deg_s": 5}}, "held.tilt_rate_deg_s"),
    ],
)
def test_a_bad_setting_of_an_experiment_is_named(kind, own, name):
    with refused(ConfigError, name, key=f"experiments.{kind}"):
        salt_settings({"experiments": {kind: own}})


def test_levers_that_the_emulators_hold_are_named_each_with_line_and_column():
    settings = salt_settings()
    rows = [
        drop(10.0, 3),
        drop(100.0, 4, particle_diameter_mm=9.0),
        drop(100.0, 5, scale_factor=2.0),
        drop(100.0, 6, output_interval_s=0.01),
        Measurement("shear", 1.0, 0.1, 5, {"particle_diameter_mm": 3.0}, "", 7),
    ]
    with pytest.raises(MeasurementErrors) as caught:
        check_levers(settings, rows, "m.csv")
    lines = str(caught.value).splitlines()
    wanted = ["5, column scale", "7, column particle_dia"]
    assert len(lines) == len(wanted)
    for line, where in zip(lines, wanted, strict=True):
        assert line.startswith(f"m.csv, line {where}")
    assert "allowed: empty or 2" in lines[1]


def test_the_ranges_of_the_levers_are_as_wide_as_the_measurements():
    settings = salt_settings()
    before, load = (settings.experiments[e].levers for e in ("drop", "shear"))
    rows = [drop(10.0, 3), drop(700.0, 4), drop(100.0, 5, particle_diameter_mm=9.0)]
    after = completed(settings, None, [], rows, "m.csv").experiments
    assert after["drop"].levers["drop_height_mm"] == [10.0, 700.0]
    assert after["drop"].levers["particle_diameter_mm"] == [before["particle_diameter_mm"][0], 9.0]
    assert after["shear"].levers == load
    assert completed(settings, None, [], [], "m.csv").experiments == settings.experiments


def test_a_fault_in_a_test_is_named_by_its_key():
    data = {"name": "s", "factors": "f", "measurements": "m"}
    ball = {"experiment": "drop", "diagnosis": {"levers": {"colour": [1, 2]}}}
    with refused(ConfigError, "levers.colour", key="tests.ball.diagnosis"):
        study_settings(Config.model_validate(data | {"tests": {"ball": ball}}))
    plain = data | {"tests": {"ball": {"experiment": "drop"}}, "diagnosis": {"seed": "x"}}
    with refused(ConfigError, key="diagnosis.seed", value="x"):
        study_settings(Config.model_validate(plain))


def test_the_run_of_a_test_counts_below_that_of_its_diagnosis():
    ball = {"experiment": "drop", "run": {"geometry": {"drop_height_mm": 90, "drops": 3}}}
    ball["diagnosis"] = {"run": {"geometry": {"drops": 24}}}
    data = {"name": "s", "factors": "f", "measurements": "m", "tests": {"ball": ball}}
    found = study_settings(Config.model_validate(data)).experiments["drop"].run
    assert found == {"geometry": {"drop_height_mm": 90, "drops": 24}}


def test_ranges_of_factors_can_be_replaced():
    name = "contacts.particle_wall.restitution"
    settings = salt_settings({"ranges": {name: [0.85, 0.99]}})
    [factor] = parameters_of(settings, "config/factors.tsv", ["drop"])
    assert (factor.low, factor.high) == (0.85, 0.99)
    with refused(ConfigError, path="factors.tsv", key="ranges", value="gold"):
        parameters_of(salt_settings({"ranges": {"gold": [0, 1]}}), "config/factors.tsv", ["drop"])
    with refused(
        ConfigError, key="diagnosis.ranges.contacts.particle_wall.restitution", value=[1.0, 0.0]
    ):
        parameters_of(salt_settings({"ranges": {name: [1, 0]}}), "config/factors.tsv", ["drop"])
