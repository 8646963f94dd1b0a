"""What stands in the terminal: a line for each step, our own sentences and each error as a
sentence, from plain snakemake and from `calibration run` alike."""

import logging
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from deployed import write_study
from snakemake_interface_logger_plugins.common import LogEvent

from calibration.interface.cli import main
from facts import tells
from snakemake_logger_plugin_calibration import LogHandler

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
