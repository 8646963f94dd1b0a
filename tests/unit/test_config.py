"""What a configuration must give before any run starts, and what of it names a run. `refusals.py`
has wrong values."""

from pathlib import Path

import pytest
import yaml

from calibration.errors import ConfigError
from calibration.runs.plans import plan
from calibration.statistics.design import box_behnken, steepest_path
from calibration.study.config import given, parse_config
from calibration.study.config.tests import swept_test
from calibration.study.factors import read_factors
from facts import refused

ROOT = Path(__file__).parents[2]


@pytest.fixture
def data(monkeypatch):
    monkeypatch.chdir(ROOT)
    return yaml.safe_load((ROOT / "config" / "config.yaml").read_text())


def test_a_stage_without_its_section_names_stage_and_key(monkeypatch):
    monkeypatch.chdir(ROOT)
    config = parse_config(yaml.safe_load(Path("examples/soybean/config.yaml").read_text()))
    with refused(ConfigError, "scaling", key="scaling", value=None):
        given(config, "scaling", "scaling")
    with refused(ConfigError, "tilt", key="tests", value=None):
        swept_test(config, "tilt")


def test_equal_points_share_a_run_and_replicates_do_not(data):
    config, table = parse_config(data), read_factors("config/factors.tsv")
    chosen = [f for f in table if f.code in "CEG"]
    design = box_behnken(chosen, centre_runs=5)
    planned, specs = plan(design, table, config, config.experiment, config.own_run)
    assert planned["run_id"].is_unique
    assert len(specs) == 17
    centre = {f.name: f.centre for f in chosen}
    path = steepest_path(chosen, centre, {f.name: 0.0 for f in chosen}, 1)
    shared, _ = plan(path, table, config, config.experiment, config.own_run)
    assert shared["run_id"][0] in set(planned["run_id"])
