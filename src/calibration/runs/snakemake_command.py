"""Where the workflow is: it comes with the package. In a clone its folder is a link to `workflow/`
at the root."""

import signal
import subprocess
import sys
from pathlib import Path

WORKFLOW = Path(__file__).parents[1] / "workflow"
OWN = ("Snakefile", "workflow/Snakefile")
"""Where snakemake looks for a workflow by itself."""


def call(command, **keys):
    """`subprocess.run`, but an interrupt waits for the end: snakemake then stops its jobs, which
    keep what they have."""
    with subprocess.Popen(command, **keys) as process:
        try:
            out, err = process.communicate()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def snakemake_command(files, *arguments):
    """The command that runs the workflow for the configuration `files` with further arguments of
    snakemake's: that of the current folder where it has one, as a clone does, else the
    package's."""
    snakefile = next((name for name in OWN if Path(name).is_file()), WORKFLOW / "Snakefile")
    # --snakefile takes one value: what follows it is no further configuration file
    named = ["--configfile", *files, "--snakefile", snakefile]
    return [sys.executable, "-m", "snakemake", *map(str, named), *arguments]
