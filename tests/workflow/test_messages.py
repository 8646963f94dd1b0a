"""What a user reads: a run that fails, the campaign's progress and the time left, and in the
terminal a line for each step, our own sentences and each error as a sentence."""

import logging
import signal
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
import yaml
from deployed import write_study
from snakemake_interface_logger_plugins.common import LogEvent

from calibration import engines
from calibration.interface.cli import main
from calibration.runs.plans import plan, write_plan
from calibration.runs.progress import Plan, Progress
from calibration.runs.runner import report, run_each
from calibration.runs.store import RunStore
from calibration.statistics.design import plackett_burman
from calibration.study.config import parse_config
from calibration.study.factors import read_factors
from dem.errors import BlowUpError
from dem.results import write_result
from dem.spec import parse_spec
from facts import ROOT, tells
from snakemake_logger_plugin_calibration import LogHandler


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
    write_plan("results/few/screening/plan.json", table, specs)
    return config.model_dump(mode="json"), table, specs


def blows_up(*_, **__):
    raise BlowUpError(particle=1, time=0.1, reason="overlap", hint="the time step")


def test_a_failed_run_names_its_point_its_log_and_the_likely_cause(campaign, capsys, monkeypatch):
    settings, table, specs = campaign
    row = table.iloc[3]
    folder = RunStore().folder(row["run_id"])

    monkeypatch.setattr(engines, "make", blows_up)
    with pytest.raises(SystemExit):
        run_each({row["run_id"]: specs[row["run_id"]]}, settings)
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
        folder = RunStore().folder(name)
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
    runs = (("a", 17), ("b", 3), ("c", 20))
    plans = tuple(Plan(name, 0, total, each_s=60.0) for name, total in runs)
    assert Progress(plans).left_s(cores) == 60.0 * rounds


def test_a_stage_above_that_is_under_way_has_a_time_of_its_own():
    """Ten runs of 100 s on two cores; the chain's 24 are not asked for meanwhile."""
    chain = Plan("screening", 0, 24, planned=False, each_s=60.0)
    above = Plan("disagreement", 1, 11, apart=True, each_s=100.0)
    assert Progress((above, chain)).left_s(2) == 500.0
    said = Progress((above, chain)).sentence(2)
    assert tells(said, "1 of 11", "8 min", "that")
    assert not tells(said, "estimated")
    assert Progress((replace(above, done=11), chain)).left_s(2) == 12 * 60.0


OWN_AFFAIRS = (
    "SNAKEMAKE", "Host:", "DAG", "Reason", "[", "Execute", "Select", "Updating", "WorkflowError",
    "common.smk", "resources", "Finished", "Complete log", "Building", "Job ",
)  # fmt: skip


@pytest.fixture
def study(tmp_path, monkeypatch):
    write_study(tmp_path / "bounce")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "bounce"


def own_affairs(lines):
    """Lines that are for snakemake's developers."""
    return [x for x in lines if x.strip().startswith(OWN_AFFAIRS)]


def test_a_dry_run_is_a_line_a_job_and_our_own(study, capfd):
    assert main(["run", "bounce", "-n"]) == 0
    out, err = capfd.readouterr()
    for words in ("read bounce/measured.csv", "drops: 0 of ", "plan the screening"):
        assert words in out + err
    lines = (out + err).splitlines()
    assert all(line.strip() for line in lines)
    assert not own_affairs(lines)
    counted, *steps = out.splitlines()  # each in a line of its own
    assert counted == f"{len(steps) - 2} steps and 2 jobs of runs"  # the answer's
    assert "plan the screening" in steps


def test_a_mistake_is_its_sentence_alone(study, capfd):
    config = study / "config.yaml"
    config.write_text(config.read_text().replace("replicates:", "replicats:"))
    assert main(["run", "bounce", "-n"]) == 1
    found = "".join(capfd.readouterr()).splitlines()
    [line] = [x for x in found if not x.startswith("Using workflow specific profile")]
    assert "config.yaml, line" in line
    assert tells(line, "screening.replicats")


def handler(capsys, **changed):
    """A handler that writes to the captured streams; what it has written since."""
    settings = {"stdout": False, "verbose": False, "debug_dag": False, "printshellcmds": False}
    settings |= {"dryrun": False, "show_failed_logs": True} | changed
    made = LogHandler(SimpleNamespace(**settings), None)

    def told(text=None, level=logging.INFO, **more):
        record = logging.LogRecord("snakemake", level, "", 0, text, None, None)
        vars(record).update(more)
        made.emit(record)
        return "".join(capsys.readouterr()).strip()

    return told


RUN = {"output": ["result.json"], "rule_name": "dem_run", "rule_msg": "DEM run heap-1"}
STAGE = {"output": ["a.csv"], "rule_name": "ascent", "rule_msg": "steepest ascent"}
FAILED = {"rule_name": "ascent", "rule_msg": "steepest ascent", "log": ["a.log"]}


@pytest.mark.parametrize(("dryrun", "run"), [(False, ""), (True, "DEM run heap-1")])
def test_each_step_is_a_line(capsys, dryrun, run):
    told = handler(capsys, dryrun=dryrun)
    why = {"event": LogEvent.JOB_INFO, "reason": "Missing output files: a.csv"}
    assert told(None, **why, **STAGE) == "steepest ascent"
    assert told(None, **why, **RUN) == run
    assert told(None, **why, **(STAGE | {"output": []})) == ""
    changed = why | {"reason": "Params have changed since last execution: before: 1, now: 2"}
    said = "steepest ascent (its code, settings or tables have changed)"
    assert told(None, **changed, **STAGE) == (said if dryrun else "steepest ascent")


def test_an_error_is_a_sentence(capsys):
    told = handler(capsys)
    said = told(None, logging.ERROR, event=LogEvent.JOB_ERROR, **FAILED)
    assert tells(said, "failed", "steepest ascent", "a.log")
    ours = 'WorkflowError in file "x.smk", line 3:\nfactors.tsv: is empty\n  File "x.smk", line 3'
    error = {"event": LogEvent.ERROR}
    assert told(ours, logging.ERROR, exception="WorkflowError", **error) == "factors.tsv: is empty"
    inside = "InputFunctionException in rule a:\nError:\n  WorkflowError:\n    x: no\nWildcards:\n"
    assert told(inside, logging.ERROR, exception="InputFunctionException", **error) == "x: no"
    ended = "RuleException:\nCalledProcessError in file x.smk, line 3:\nCommand set"
    assert told(ended, logging.ERROR, exception="RuleException", **error) == ""
    other = "SyntaxError: no rule"
    assert told(other, logging.ERROR, exception="SyntaxError", **error) == other


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_reaches_what_runs_and_is_waited_for(tmp_path, sent):
    child = (
        "import signal, sys, time, pathlib\n"
        "def end(*_): time.sleep(0.3); pathlib.Path('ended').touch(); sys.exit(5)\n"
        "for s in (signal.SIGTERM, signal.SIGINT): signal.signal(s, end)\n"
        "pathlib.Path('began').touch(); time.sleep(60)\n"
    )
    parent = (  # begun in the background, a process ignores SIGINT unless it asks for it
        "import signal, sys; from calibration.runs.snakemake_command import call\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"sys.exit(call([sys.executable, '-c', {child!r}]).returncode)"
    )
    quiet = subprocess.DEVNULL
    with subprocess.Popen([sys.executable, "-c", parent], cwd=tmp_path, stderr=quiet) as process:
        end = time.monotonic() + 60
        while not (tmp_path / "began").exists() and time.monotonic() < end:
            time.sleep(0.05)
        process.send_signal(sent)
        try:
            process.wait(60)
        finally:
            process.kill()
    assert (tmp_path / "ended").exists()
