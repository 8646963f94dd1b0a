"""What a user reads: a run that fails, the campaign's progress, and the time left."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from calibration import engines
from calibration.runs.plans import plan, result_path, write_plan
from calibration.runs.progress import Plan, Progress
from calibration.runs.runner import report, run_logged
from calibration.statistics.screening_design import plackett_burman
from calibration.study.config import parse_config
from calibration.study.factors import read_factors
from dem.errors import BlowUpError
from dem.results import write_result
from dem.spec import parse_spec
from facts import tells

ROOT = Path(__file__).parents[2]


@pytest.fixture
def campaign(tmp_path, monkeypatch):
    """A screening of heaps of too few grains, planned: its settings, table and {run id: spec}."""
    data = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    run = {"particles": {"count": 5, "diameter_mm": 6.0}}
    data |= {"run": run, "tests": {"heap": {"experiment": "heap"}}, "predict": {}}
    data |= {"name": "few", "optimise": {"candidate_runs": 10}}
    data["validation"] = {"groups": 5, "replicates": 5, "margin": 1.0}
    (tmp_path / "config").symlink_to(ROOT / "config")
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    config = parse_config(data)
    factors = read_factors(config.factors)
    table, specs = plan(
        plackett_burman(factors), factors, config, config.experiment, config.own_run
    )
    write_plan("results/few/screening", table, specs)
    return config.model_dump(mode="json"), table, specs


def blows_up(*_, **__):
    raise BlowUpError(particle=1, time=0.1, reason="overlap", hint="the time step")


def test_a_failed_run_names_its_point_its_log_and_the_likely_cause(campaign, capsys, monkeypatch):
    settings, table, specs = campaign
    row = table.iloc[3]
    folder = Path(result_path(row["run_id"])).parent

    monkeypatch.setattr(engines, "make", blows_up)
    with pytest.raises(SystemExit):
        run_logged(specs[row["run_id"]], folder, folder / "run.log", settings)
    shown = capsys.readouterr().err
    assert f"run {row['run_id']} failed: particle 1" in shown
    assert tells(shown, "screening", "run 4 of 12", "seed 1")
    assert str(folder / "run.log") in shown
    # snakemake shows the log: it must tell the same
    assert "point:  screening, run 4" in (folder / "run.log").read_text()
    assert yaml.safe_load((folder / "failed.yaml").read_text()) == specs[row["run_id"]]
    assert not (folder / "result.json").exists()
    report(parse_config(settings))
    assert tells(capsys.readouterr().err, "0 of 69", "1 failed")


def test_progress_counts_every_stage_and_tells_the_time_left(campaign, capsys, monkeypatch):
    settings, table, specs = campaign
    for name in table["run_id"][:3]:
        folder = Path(result_path(name)).parent
        write_result(folder, parse_spec(specs[name]), {}, {"wall_time_s": 60.0}, files=())
    monkeypatch.setenv("CAMPAIGN_CORES", "2")
    config = parse_config(settings)
    report(config)
    shown = capsys.readouterr().err
    assert tells(shown, "few", "3 of 69", "none failed", "screening (3 of 12)")
    # 9, 5, 17, 10 and 25 runs of a minute on two cores: a stage waits for the one before it
    assert tells(shown, "35 min", "2 cores")


@pytest.mark.parametrize(("cores", "rounds"), [(1, 40), (4, 11), (100, 3)])
def test_the_time_left_is_right_for_any_number_of_cores(cores, rounds):
    """17, 3 and 20 runs: what is idle at the end of a stage counts."""
    plans = tuple(Plan(name, 0, runs) for name, runs in (("a", 17), ("b", 3), ("c", 20)))
    assert Progress(plans, 60.0, None).left_s(cores) == 60.0 * rounds


def test_a_stage_above_that_is_under_way_has_a_time_of_its_own():
    """Ten runs of 100 s on two cores; the chain's 24 are not asked for meanwhile."""
    chain = Plan("screening", 0, 24, planned=False, each_s=60.0)
    above = Plan("disagreement", 1, 11, above=True, each_s=100.0)
    assert Progress((above, chain), None, None).left_s(2) == 500.0
    said = Progress((above, chain), None, None).sentence(2)
    assert tells(said, "1 of 11", "8 min", "that")
    assert not tells(said, "estimated")
    assert Progress((replace(above, done=11), chain), None, None).left_s(2) == 12 * 60.0
