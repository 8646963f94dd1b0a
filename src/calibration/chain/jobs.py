"""What every script of the workflow needs: its log, and the call of its function."""

import sys
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from calibration.chain.study import Study
from calibration.errors import CalibrationError, in_words, of_the_machine
from calibration.intake.started_code import permit
from calibration.runs.store import keep_runs_in
from calibration.runs.verify import FOLDER, record
from calibration.study.config import Config, with_engine
from dem.errors import DemError


@contextmanager
def logged(log: str | Path) -> Iterator[None]:
    """Send what a stage prints to its log; an error of ours, or a refusal of the machine, ends the
    job with one line there and on the screen."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w") as stream, redirect_stdout(stream), redirect_stderr(stream):
        try:
            yield
        except Exception as error:
            if isinstance(error, CalibrationError | DemError):
                print(error, file=stream)
            elif not of_the_machine(error):
                traceback.print_exc(file=stream)
                raise
            print(in_words(error), file=sys.__stderr__)
            sys.exit(1)


def study_of(data: Mapping[str, Any]) -> Study:
    """The study of already checked settings (a mapping). Raises ConfigError where its engine's
    program is missing."""
    return Study(with_engine(Config.model_validate(data)))


def work_for(config: Mapping[str, Any]) -> Study:
    """Let this process work for the study of a checked configuration (a mapping), in whose folder
    the mark of this project stands from now on; returns the study."""
    study = study_of(config)
    Path(study.folder, FOLDER).mkdir(parents=True, exist_ok=True)
    permit(study.config)
    keep_runs_in(study.config.runs)
    return study


def run_task(job: Any) -> None:
    """Do what a rule declares: call its function with the study, its inputs and its outputs.

    job: what snakemake hands to a script; its parameters name the function, the sections of the
    configuration that the function may read, and the seeds of the runs that it plans.
    """
    with logged(job.log[0]):
        study = work_for(job.config).with_bench(job.input.get("fixed", ()))
        study = study.reading(job.params.reads, job.params.get("seeds"))
        resolve_name(job.params.function)(study, job.input, job.output)
        leave_record(job, study)


def leave_record(job: Any, study: Study) -> None:
    """Write down what a job has left, see `calibration.runs.verify`."""
    record(study.folder, Path(job.log[0]).stem, job.params.made_from, job.output)
