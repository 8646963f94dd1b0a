"""The tilt and drop tests: sweep, fit, inverse and confirmation, for whatever factor sets their
key."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration.chain.responses import spread_of
from calibration.chain.study import Study
from calibration.errors import CalibrationError, ConfigError
from calibration.stages.bench_tests import (
    METRIC,
    analyse_sweep,
    bench_parameters,
    inverse_of,
    plan_confirmation,
    plan_sweep,
)
from calibration.study.config import numbers_of, overlay, parse_config
from calibration.study.config.tests import SWEPT
from facts import refused
from made_up import answer
from stage_files import Files, PlanFiles

OUT = Files(runs="runs.csv", figure="figure.svg", summary="summary.json")
FACTORS = {"tilt": "bean_steel_static_friction", "drop": "bean_steel_restitution"}
LAWS = {"tilt": lambda level: 50.0 * level + 3.0, "drop": lambda level: 100.0 * level**2}


@pytest.fixture
def config(with_data):
    """The soybean study with bench tests of its own."""
    data = yaml.safe_load(Path("examples/soybean/config.yaml").read_text())
    levels = {"tilt": [0.2, 0.25, 0.3, 0.35], "drop": [0.4, 0.5, 0.6, 0.7]}
    tests = {name: {"experiment": name, "sweep": {"levels": own}} for name, own in levels.items()}
    write_measured()
    return parse_config(overlay(data, {"tests": tests, "measurements": "bench.csv"}))


MEASURED = {"tilt": 18.0, "drop": 30.0}


def write_measured(drop_heights="150", drop=30.0):
    """What the laboratory read: a heap's angles, readings of a slide, the mean of rebounds."""
    header = "experiment,quantity,value,unit,sd,n,drop_height_mm\n"
    heaps = "".join(f"heap,angle_of_repose,{a},deg,,,\n" for a in (28.0, 29.0))
    slides = "".join(f"tilt,sliding_angle,{a},deg,,,\n" for a in (17.5, 18.5))
    heights = drop_heights.split()
    drops = "".join(f"drop,rebound_height,{drop},mm,1,5,{h}\n" for h in heights)
    Path("bench.csv").write_text(header + heaps + slides + drops)


def by_law(test):
    """The formula of a test's law: metrics of a spec."""

    def metrics(spec, _):
        level = numbers_of(spec)[SWEPT[test]]
        return {METRIC[test]: LAWS[test](level), spread_of(METRIC[test]): 0.1}

    return metrics


@pytest.mark.parametrize("test", ["tilt", "drop"])
def test_a_sweep_finds_the_level_that_gives_the_measured_value(config, test):
    study, sweep, confirmed = Study(config), PlanFiles.of("sweep"), PlanFiles.of("confirmation")
    plan_sweep(test, study, None, sweep)
    answer(sweep.plan, by_law(test))
    plan_confirmation(test, study, Files(sweep=sweep.design), confirmed)
    answer(confirmed.plan, by_law(test))
    analyse_sweep(test, study, Files(sweep=sweep.design, confirmation=confirmed.design), OUT)
    found = json.loads(Path(OUT.summary).read_text())
    measured = MEASURED[test]
    assert found["factor"] == FACTORS[test]
    assert LAWS[test](found["inverse"]) == pytest.approx(measured, rel=1e-6)
    assert found["confirmed_mean"] == pytest.approx(measured, rel=1e-4)
    assert found["relative_error_percent"] < 0.01
    assert list(pd.read_csv("sweep/design.csv")[FACTORS[test]]) == config.tests[test].sweep.levels


def test_the_closed_form_takes_the_drop_height_of_the_run(config):
    height = {"tests": {"drop": {"run": {"geometry": {"drop_height_mm": 120.0}}}}}
    write_measured("120")
    config = parse_config(overlay(config.model_dump(mode="json"), height))
    study, sweep = Study(config), PlanFiles.of("sweep")
    plan_sweep("drop", study, None, sweep)
    answer(sweep.plan, by_law("drop"))
    analyse_sweep("drop", study, Files(sweep=sweep.design, confirmation=sweep.design), OUT)
    assert json.loads(Path(OUT.summary).read_text())["closed_form"] == np.sqrt(30.0 / 120.0)


def test_a_measured_value_outside_the_sweep_is_refused(config):
    sweep = PlanFiles.of("sweep")
    plan_sweep("drop", Study(config), None, sweep)
    answer(sweep.plan, by_law("drop"))
    write_measured(drop=90.0)
    study = Study(config)
    with refused(CalibrationError, "0.4", "0.7", "90"):
        plan_confirmation("drop", study, Files(sweep=sweep.design), PlanFiles.of("confirmation"))


def test_the_measured_value_is_that_of_the_rigs_own_setting(config):
    study, sweep = Study(config), PlanFiles.of("sweep")
    plan_sweep("drop", study, None, sweep)
    answer(sweep.plan, by_law("drop"))
    header, *rows = Path("bench.csv").read_text().splitlines()
    other = "drop,rebound_height,70,mm,1,5,300"
    Path("bench.csv").write_text("\n".join([header, other, *rows]) + "\n")
    plan_confirmation("drop", study, Files(sweep=sweep.design), PlanFiles.of("confirmation"))
    level = pd.read_csv("confirmation/design.csv")[FACTORS["drop"]][0]
    assert LAWS["drop"](level) == pytest.approx(30.0, rel=1e-5)
    write_measured("300")
    with refused(
        ConfigError, "150", path="bench.csv", line=6, column="drop_height_mm", value=300.0
    ):
        plan_confirmation("drop", study, Files(sweep=sweep.design), PlanFiles.of("confirmation"))
    Path("bench.csv").write_text("\n".join([header, *rows, rows[-1].replace(",150", ",")]) + "\n")
    with refused(ConfigError, path="bench.csv", line=7, column="drop_height_mm"):
        plan_confirmation("drop", study, Files(sweep=sweep.design), PlanFiles.of("confirmation"))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_two_levels_the_one_is_taken_where_the_curve_runs_as_from_end_to_end(sign):
    """(x - 0.3)^2 over 0.2 to 0.9 has the value 0.0049 at 0.23, before the turn, and at 0.37."""
    curve = sign * np.array([1.0, -0.6, 0.09])
    assert inverse_of(curve, sign * 0.0049, 0.2, 0.9) == pytest.approx(0.37)
    with refused(CalibrationError, "0.2", "0.9"):
        inverse_of(curve, sign * 5.0, 0.2, 0.9)


def test_the_levels_of_the_bench_tests_are_written_whatever_else_the_workflow_hands_on(tmp_path):
    """Such as the file that tells what the stage is made from, which is no summary."""
    found = {"tilt": ("static", 0.71), "drop": ("restitution", 0.40004), "shear": ("inner", None)}
    files = {name: tmp_path / f"{name}.json" for name in found}
    for name, (factor, inverse) in found.items():
        files[name].write_text(json.dumps({"factor": factor, "inverse": inverse}))
    (tmp_path / "stamp").write_text("0a1b")
    source = Files(made_from=tmp_path / "stamp", **files)
    bench_parameters(None, source, Files(fixed=tmp_path / "fixed.json"))
    levels = {"static": 0.71, "restitution": 0.4}
    assert json.loads((tmp_path / "fixed.json").read_text()) == {"fixed": levels}
