"""What `calibration run` passes on of what snakemake says: our words and its errors."""

import signal
import subprocess
import sys
import time

import pytest
from deployed import write_study

from calibration.interface.cli import main
from calibration.telling.plainly import tell

OWN_AFFAIRS = (
    "SNAKEMAKE", "Host:", "DAG", "Reason", "Using workflow", "[", "Execute", "WorkflowError",
    "common.smk", "resources",
)  # fmt: skip


@pytest.fixture
def study(tmp_path, monkeypatch):
    write_study(tmp_path / "bounce")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "bounce"


def test_a_dry_run_is_a_line_a_job_and_our_own(study, capfd):
    assert main(["run", "bounce", "-n"]) == 0
    said = "".join(capfd.readouterr())
    for words in ("read bounce/measured.csv", "drops: 0 of ", ": plan the screening"):
        assert words in said
    lines = said.splitlines()
    assert all(line.strip() for line in lines)
    assert not [x for x in lines if x.strip().startswith(OWN_AFFAIRS)]


def test_a_mistake_is_its_sentence_alone(study, capfd):
    config = study / "config.yaml"
    config.write_text(config.read_text().replace("replicates:", "replicats:"))
    assert main(["run", "bounce", "-n"]) == 1
    [line] = "".join(capfd.readouterr()).splitlines()
    assert "config.yaml, line" in line
    assert "screening.replicats: is not valid" in line


@pytest.mark.parametrize(("options", "kept"), [([], 2), (["--verbose"], 3), (["--quiet"], 3)])
def test_errors_are_passed_on_and_all_where_it_is_asked_for(options, kept, capfd):
    told = ["Error in rule screening:", "cannot tell these terms apart", "1 of 2 steps (50%) done"]
    script = f"import sys; [print(x, file=sys.stderr) for x in {told!r}]; sys.exit(3)"
    assert tell([sys.executable, "-c", script, *options]) == 3
    assert capfd.readouterr().err.splitlines() == told[:kept]


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_reaches_what_runs_and_is_waited_for(tmp_path, sent):
    child = (
        "import signal, sys, time, pathlib\n"
        "def end(*_): time.sleep(0.3); pathlib.Path('ended').touch(); sys.exit(5)\n"
        "for s in (signal.SIGTERM, signal.SIGINT): signal.signal(s, end)\n"
        "pathlib.Path('began').touch(); time.sleep(60)\n"
    )
    parent = (  # begun in the background, a process ignores SIGINT unless it asks for it
        "import signal, sys; from calibration.telling.plainly import tell\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"sys.exit(tell([sys.executable, '-c', {child!r}]))"
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
