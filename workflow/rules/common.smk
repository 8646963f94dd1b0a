import hashlib
import os
import sys
from pathlib import Path

from calibration.campaign import planned_spec, read_plan, result_path
from calibration.config import parse_config, stands_alone
from calibration.config.as_data import refuse_unasked_code
from calibration.errors import CalibrationError
from calibration.opening import opening
from calibration.runner import begin
from dem.experiments import experiments
from dem.fingerprint import engine_fingerprint

CONFIG_FILES = list(workflow.overwrite_configfiles)

# a file with its own factors is a study of its own; any other is laid over the salt's
if not any(stands_alone(path) for path in CONFIG_FILES):
    CONFIG_FILES.insert(0, "config/config.yaml")

    configfile: "config/config.yaml"


try:
    SETTINGS = parse_config(config, files=CONFIG_FILES)
    # in a dry run too: what cannot be trusted, how many runs there are, and how many are left
    if workflow.is_main_process:
        refuse_unasked_code(SETTINGS, asked=workflow.config_settings.config)
        print(*opening(SETTINGS), sep="\n", file=sys.stderr)
        begin(SETTINGS, dry_run=workflow.output_settings.dryrun)
except CalibrationError as error:
    raise WorkflowError(str(error))

# the runs' progress line divides the work by this; it is no parameter of any run
os.environ.update(CAMPAIGN_CORES=str(workflow.cores or 1))

# a parameter of all rules that read the settings: they are made again when any setting changes. The scripts take the settings
# themselves from snakemake's config, as `snakemake -n` prints every parameter that has changed
SETTINGS_DIGEST = hashlib.sha256(SETTINGS.model_dump_json().encode()).hexdigest()[:12]

STUDY = f"results/{SETTINGS.name}"
TARGETS = [
    target.file
    for target in (SETTINGS.target, *SETTINGS.further_targets)
    if target.file
]

# an input of all plans of heaps; where `fixed_from` is bench they wait for the bench tests and take their values
BENCH_VALUES = [f"{STUDY}/bench/fixed.json"] if SETTINGS.fixed_from == "bench" else []


wildcard_constraints:
    experiment="|".join(experiments()),
    digest="[0-9a-f]{16}",


def spec_of(name):
    """The spec of a planned run."""
    spec = planned_spec(STUDY, name)
    if spec is None:
        raise WorkflowError(f"no stage of {STUDY} has planned the run {name}")
    return spec


def for_further_targets(pattern, measured=False):
    """A file of each further target in the study's folder, or of each with a measurement; none with one target."""
    return [
        f"{STUDY}/{pattern}".format(target.metric)
        for target in SETTINGS.further_targets
        if target.file or not measured
    ]


def results_of(plan_file):
    """Result files of all runs of a plan."""
    return [result_path(name) for name in read_plan(plan_file)]


# runs of a second or two share a process; the number of batches is the number of processes that a stage can use at once
BATCHES_OF = {
    "tilt": 2,
    "tilt_confirmation": 1,
    "drop": 1,
    "drop_confirmation": 1,
    "shear": 2,
    "scaling": 4,
}


def batches_of(stage):
    """What shows that all runs of a stage's plan are done."""
    return [f"{STUDY}/{stage}/batches/{n}.json" for n in range(BATCHES_OF[stage])]
