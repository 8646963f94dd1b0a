"""Where the workflow is: it comes with the package. In a clone its folder is a link to `workflow/`
at the root."""

import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

WORKFLOW = Path(__file__).parents[1] / "workflow"
OWN = ("Snakefile", "workflow/Snakefile")
"""Where snakemake looks for a workflow by itself."""
LOGGER = "calibration"
"""The logger plugin of snakemake, `snakemake_logger_plugin_calibration`: a line for each step."""
PROFILE = ("--workflow-profile", "--profile")


def call(
    command: Sequence[str], each: Callable[[str], object] | None = None, **keys: Any
) -> subprocess.CompletedProcess:
    """`subprocess.run`, but a signal to end reaches the command, which is waited for: snakemake
    then stops its jobs, which keep what they have.

    each: takes every line that the command says, as it is said; all of them are then `stdout`.
    """
    if each is not None:
        keys |= {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, **keys) as process, _passed_on(signal.SIGTERM, process):
        try:
            out, err = (_said(process, each), None) if each else process.communicate()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def _said(process, each):
    lines = []
    for line in process.stdout:
        lines.append(line)
        each(line.rstrip("\n"))
    process.wait()
    return "".join(lines)


@contextmanager
def _passed_on(number, process):
    """Send a signal on to a process, as far as this thread can take it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(number, lambda *_: process.send_signal(number))
    try:
        yield
    finally:
        signal.signal(number, former)


def snakemake_command(files: Iterable[str | Path], *arguments: str) -> list[str]:
    """The command that runs the workflow for the configuration `files` with further arguments of
    snakemake's: that of the current folder where it has one, as a clone does, else the
    package's."""
    snakefile = next((name for name in OWN if Path(name).is_file()), WORKFLOW / "Snakefile")
    # --snakefile takes one value: what follows it is no further configuration file
    named = ["--configfile", *files, "--snakefile", snakefile]
    return [sys.executable, "-m", "snakemake", *map(str, named), *_with_profiles(arguments)]


def _with_profiles(arguments: tuple[str, ...]) -> list[str]:
    """The arguments, where a profile that is no folder here is the package's of that name:
    `--workflow-profile profiles/slurm`, or `slurm`, in a folder without a clone."""
    found = list(arguments)
    for place, before in enumerate(arguments[:-1], start=1):
        own = WORKFLOW / "profiles" / Path(arguments[place]).name
        if before in PROFILE and not Path(arguments[place]).is_dir() and own.is_dir():
            found[place] = str(own)
    return found


def rule_names() -> set[str]:
    """Names of the workflow's rules, as its files have them."""
    files = [WORKFLOW / "Snakefile", *WORKFLOW.rglob("*.smk")]
    found = (re.findall(r"^(?:rule|checkpoint) (\w+):", f.read_text(), re.M) for f in files)
    return {name for names in found for name in names}
