"""The workflow's rules as snakemake reads them, for tests that call a stage as its rules do."""

import re
import subprocess
import sys
from contextlib import redirect_stderr
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from pkgutil import resolve_name

import yaml
from snakemake.api import SnakemakeApi
from snakemake.settings.types import (
    ConfigSettings,
    DeploymentSettings,
    OutputSettings,
    Quietness,
    ResourceSettings,
    StorageSettings,
    WorkflowSettings,
)
from snakemake_interface_executor_plugins.settings import ExecMode

from facts import ROOT
from opened.watch import undeclared, watching
from stage_files import Files


def planned_jobs(folder, *arguments, environment=None):
    """{rule: number of jobs} of a dry run in a folder; see `dry_run`."""
    return dry_run(folder, *arguments, environment=environment)[0]


def dry_run(folder, *arguments, environment=None):
    """({rule: number of jobs}, all that is said) of a dry run in a folder, from the table that
    snakemake prints where commands are asked for."""
    command = [sys.executable, "-m", "snakemake", "-n", "-j2", "--printshellcmds", *arguments]
    done = subprocess.run(
        command, cwd=folder, env=environment, text=True, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    jobs = {rule: int(n) for rule, n in re.findall(r"^(\w+) +(\d+)$", done.stdout, re.M)}
    # a table that is not read must not pass for a plan without a job
    assert jobs.pop("total", 0) == sum(jobs.values()), done.stdout
    assert jobs or "Nothing to be" in done.stdout, done.stdout
    return jobs, done.stdout


@dataclass(frozen=True)
class Declared:
    """A rule: what its `params` say of the call, and its files by name. Inputs that are functions
    are left out."""

    name: str
    function: str
    reads: tuple
    seeds: int | None
    source: Files
    output: Files

    def call(self, study):
        """Do what the rule does for a study. It touches no result that the rule does not
        declare."""
        with watching() as seen:
            resolve_name(self.function)(
                study.reading(self.reads, self.seeds), self.source, self.output
            )
        files = [*flat(self.source), *flat(self.output)]
        assert undeclared(seen, files, study.config.results) == [], self.name

    @property
    def plan(self):
        """plan.json where the rule plans runs, else None."""
        path = self.output.get("plan")
        return path if path and path.endswith("/plan.json") else None


def flat(files):
    """Paths of `Files`, those of its lists among them."""
    return [p for one in files for p in (one if isinstance(one, list) else [one])]


def read_workflow(configuration, snakefile=ROOT / "workflow/Snakefile", folder=None):
    """The `snakemake.workflow.Workflow` of a configuration, a mapping or a file, with all rules
    read. folder: where it is called, here unless given."""
    if isinstance(configuration, dict):
        path = Path("read_workflow.yaml").resolve()
        path.write_text(yaml.safe_dump(configuration))
        configuration = path
    with SnakemakeApi(OutputSettings(quiet={Quietness.ALL})) as api, redirect_stderr(StringIO()):
        found = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(configfiles=[Path(configuration)]),
            storage_settings=StorageSettings(),
            # as a job reads the rules: nothing is checked, set aside or said
            workflow_settings=WorkflowSettings(exec_mode=ExecMode.SUBPROCESS),
            deployment_settings=DeploymentSettings(),
            snakefile=snakefile,
            workdir=folder,
        )
        return found._workflow


def rules_of(configuration, snakefile=ROOT / "workflow/Snakefile", folder=None):
    """{name: `Declared`} of the rules that call a function, for a configuration; see
    `read_workflow`."""
    rules = read_workflow(configuration, snakefile, folder).rules
    return {rule.name: _declared(rule) for rule in rules if hasattr(rule.params, "function")}


def _declared(rule):
    params = rule.params
    return Declared(
        rule.name, params.function, tuple(params.reads), getattr(params, "seeds", None),
        _files(rule.input), _files(rule.output),
    )  # fmt: skip


def _files(named):
    """Files by name that are no functions."""
    found = {}
    for name, value in named.items():
        several = isinstance(value, list | tuple)
        paths = [str(p) for p in (value if several else [value]) if not callable(p)]
        if paths or several:
            found[name] = paths if several else paths[0]
    return Files(**found)
