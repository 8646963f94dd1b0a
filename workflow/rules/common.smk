import os
import sys
from pathlib import Path

from snakemake.io import get_flag_value

from calibration.runs.batches import batch_count, unpack_runs
from calibration.runs.plans import planned_spec, read_plan
from calibration.study.config import Config, given, parse_config, stands_alone
from calibration.study.config.as_data import refuse_unasked_code
from calibration.errors import CalibrationError, in_words
from calibration.fresh import digest, digest_with, stamp, task_digest
from calibration.telling.opening import closing, opening
from calibration.runs.runner import begin, watch
from calibration.study.stages import Figure, PerTarget, Runs, load_stages
from calibration.chain.study import Study
from calibration.runs.verify import MISSING, SET_ASIDE
from dem.errors import DemError
from dem.experiments import experiments
from dem.fingerprint import engine_fingerprint

CONFIG_FILES = list(workflow.overwrite_configfiles)

# a file with its own factors is a study of its own; any other is laid over the folder's. What a
# module is given as its `config` is whole
if not workflow.modifier.skip_configfile and not any(map(stands_alone, CONFIG_FILES)):
    CONFIG_FILES.insert(0, "config/config.yaml")

    configfile: "config/config.yaml"


# in a storage too the packages read and write the local copies, beside an index that no rule names
STORED = workflow.storage_settings.default_storage_provider is not None
if STORED and not workflow.storage_settings.keep_storage_local:
    raise WorkflowError(
        "--default-storage-provider: add --keep-storage-local-copies, since stages read what "
        "earlier ones left (docs/howto-deploy.md)"
    )

# rules name paths below RESULTS as they are without the prefix that a `module` statement may ask
# for, and without that of a storage; the packages read and write them where they are
RESULTS = str(config.get("results", Config.model_fields["results"].default))
config = {**config, "results": str(workflow.modifier.modify_path(RESULTS))}

# modules that declare stages; those of SUPPLEMENTS count for a study that names one of theirs
DECLARED = ["calibration.study.stages", "diagnosis.declared"]
for module in globals().get("SUPPLEMENTS", []):
    if set(load_stages(module)) & set(config.get("supplements") or ()):
        DECLARED.append(module)
STAGES = load_stages(*DECLARED)

try:
    STUDY_OBJECT = Study(parse_config(config, files=CONFIG_FILES, stages=STAGES))
    if workflow.is_main_process:
        refuse_unasked_code(STUDY_OBJECT.config, asked=workflow.config_settings.config)
except (CalibrationError, DemError) as error:
    raise WorkflowError(str(error))
except OSError as error:
    raise WorkflowError(in_words(error))

SETTINGS = STUDY_OBJECT.config
STUDY, RUNS = f"{RESULTS}/{SETTINGS.name}", f"{RESULTS}/runs"
TASKS = [task for stage in STAGES.values() for task in stage.tasks]
PLANS = {task.plans: task for task in TASKS if task.plans}

# the runs' progress line divides the work by this; it is no parameter of any run. A cluster's
# profile names jobs at once and no cores
SHARED_BY = workflow.resource_settings.cores or workflow.resource_settings.nodes or 1
os.environ.update(CAMPAIGN_CORES=str(SHARED_BY))


wildcard_constraints:
    experiment="|".join(experiments()),
    digest="[0-9a-f]{16}",
    batch=r"\d+",
    shard=r"\d+",


def spec_of(name):
    """The spec of a planned run."""
    spec = planned_spec(STUDY_OBJECT.folder, name)
    if spec is None:
        raise WorkflowError(
            f"no stage of {STUDY_OBJECT.folder} has planned the run {name}"
        )
    return spec


def batches_of(plan):
    """Number of processes that share the runs of a plan; None where each is a job of its own."""
    count = PLANS[plan].batches
    if count is None:
        specs = read_plan(STUDY_OBJECT.folder / plan / "plan.json")
        # what a batch did is stored in one file, so in a storage each run is in a batch
        alone = len(specs) if STORED else None
        return batch_count(specs, SETTINGS.runs_per_job) or alone
    return count(STUDY_OBJECT) if callable(count) else count


def marks_of(plan):
    """What the batches of a plan leave when all of their runs are done."""
    return [
        f"{STUDY}/{plan}/batches/{n}.{end}"
        for n in range(batches_of(plan))
        for end in (("json", "tar") if STORED else ("json",))
    ]


def runs_of(plan):
    """Input function: what shows that all runs of a plan are done."""
    if PLANS[plan].batches:
        return lambda w: marks_of(plan)
    planned = getattr(checkpoints, PLANS[plan].rule)

    def done(wildcards):
        names = read_plan(planned.get().output.plan)
        return (
            marks_of(plan)
            if batches_of(plan)
            else [f"{RUNS}/{n}/result.json" for n in names]
        )

    return done


def noted(plan, name):
    """Input function: what a start has noted of a plan since it was last used, see
    `calibration.runs.verify`."""
    return lambda wildcards: beside(f"{plan}/{name}")


def beside(name):
    """A file of the study that no job makes, for an input; [] where there is none."""
    path = STUDY_OBJECT.folder / name
    return local(str(path)) if path.exists() else []


def tables_of(task):
    """{name: paths} of the inputs of a task that are tables of the user, or that a function of the
    study names."""
    reads = {"factors": "factors", "measured": "measurements"}
    tables = {
        name: getattr(SETTINGS, section) if section in task.reads else []
        for name, section in reads.items()
    }
    named = {n: f for n, f in (task.inputs or {}).items() if callable(f)}
    return tables | {name: file(STUDY_OBJECT) for name, file in named.items()}


def content_of(task):
    """A digest of the code, the settings and the user's tables that a task reads."""
    own = [path for path in flat(tables_of(task).values()) if not of_the_results(path)]
    return digest_with(task_digest(task, SETTINGS), own)


def inputs_of(task):
    """{name: input} of a task: what it declares, and the tables that the sections it reads name."""
    files = {name: placed(paths) for name, paths in tables_of(task).items()}
    files["missing"] = missing(task)
    files["made_from"] = made_from(task.rule, lambda: content_of(task))
    if task.plans:
        files["set_aside"] = noted(task.plans, SET_ASIDE)
    for name, file in (task.inputs or {}).items():
        if isinstance(file, Runs):
            files[name] = runs_of(file.plan)
            files[f"lost_{name}"] = noted(file.plan, MISSING)
        elif not callable(file):
            files[name] = f"{STUDY}/{file}"
    return files


def made_from(rule, content):
    """An input: a file that is as old as the present code, settings and tables of a rule, whose
    digest is `content()`. By its time alone, without snakemake's own records, it makes their
    results stale. It is written before snakemake looks at what is there. A storage has none: it
    would be new on each machine."""
    name = f".made_from/{rule}"
    if workflow.is_main_process and not STORED:
        real = not workflow.output_settings.dryrun
        new = real or STUDY_OBJECT.folder.is_dir()
        stamp(STUDY_OBJECT.folder / name, content(), new)
    return beside(name)


def flat(files):
    """The paths in values that are a path or a list of them each."""
    return [
        path
        for value in files
        for path in (value if isinstance(value, list) else [value])
    ]


def of_the_results(file):
    """Whether the workflow makes a file, which else is the user's."""
    return file.startswith(f"{SETTINGS.results}/")


def placed(files):
    """Paths as rules name them: below RESULTS, or of the user's, which no prefix moves. The time of
    a user's file says nothing; `made_from` holds what is in it."""
    if isinstance(files, list):
        return [placed(file) for file in files]
    if of_the_results(files):
        return f"{RESULTS}/{files.removeprefix(f'{SETTINGS.results}/')}"
    return ancient(local(files))


def missing(task):
    """Input function without files: refuses a task that lacks a key of the configuration, or the
    measured values of the target."""

    def check(wildcards):
        try:
            for key in task.needs:
                given(SETTINGS, key, task.rule)
            if {"target", "measurements"} <= set(task.reads):
                STUDY_OBJECT.measured()
        except (CalibrationError, DemError) as error:
            raise WorkflowError(str(error))
        return []

    return check


def outputs_of(stage, task):
    """{name: output} of a task; figures have their caption and their stage's category."""
    return {name: output_of(stage, file) for name, file in task.files().items()}


def output_of(stage, file):
    if isinstance(file, PerTarget):
        targets = [
            t
            for t in SETTINGS.further_targets
            if not file.measured or STUDY_OBJECT.is_measured(t)
        ]
        return [f"{STUDY}/{file.pattern}".format(t.metric) for t in targets]
    if isinstance(file, Figure):
        caption = f"../report/{file.caption}.rst"
        return report(f"{STUDY}/{file.file}", caption=caption, category=stage.heading)
    return f"{STUDY}/{file}"


def params_of(task):
    """What the script needs, and in a storage what `made_from` holds elsewhere."""
    params = {"function": task.function, "reads": list(task.reads)}
    if STORED:
        params["fresh"] = lambda wildcards: content_of(task)
    return params if task.seeds is None else params | {"seeds": task.seeds}


def fetch(path):
    """The local copy of a file below RESULTS, fetched where the storage alone has it; None where
    neither has it or it was here."""
    local_copy = workflow.modifier.modify_path(path)
    stored = get_flag_value(local_copy, "storage_object")
    if Path(local_copy).exists() or not stored.exists():
        return None
    Path(local_copy).parent.mkdir(parents=True, exist_ok=True)
    stored.retrieve_object()
    return local_copy


def fetch_study():
    """Fetch what the storage has of the study and this machine has not: stages' files and runs."""
    for stage in STAGES.values():
        for task in stage.tasks:
            for files in outputs_of(stage, task).values():
                for file in [files] if isinstance(files, str) else files:
                    fetch(str(file))
    planned = [p for p in PLANS if (STUDY_OBJECT.folder / p / "plan.json").exists()]
    for plan in planned:
        for mark in marks_of(plan):
            copy = fetch(mark)
            if copy and copy.endswith(".tar"):
                unpack_runs(copy, SETTINGS.runs)


if STORED:
    fetch_study()

# in a dry run too: what cannot be trusted, how many runs there are, and how many are left
if workflow.is_main_process:
    try:
        print(*opening(SETTINGS), sep="\n", file=sys.stderr)
        begin(SETTINGS, dry_run=workflow.output_settings.dryrun)
    except (CalibrationError, DemError) as error:
        raise WorkflowError(str(error))
    except OSError as error:
        raise WorkflowError(in_words(error))
