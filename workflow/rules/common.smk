"""The study that the rules are for, and what they share: its folders (STUDY, RUNS), the tables of
the user, and a few functions that rules name in `input`, `output` and `params`.

In a rule's `params`, `function` is what the script calls, `reads` the sections of the configuration
that it may read, and `seeds` which thousand of seeds the runs have that it plans."""

import os
import sys
from functools import cache
from pathlib import Path

from snakemake.io import is_flagged

from calibration.study.config import Config, given, stands_alone
from calibration.study.config.joint import check_targets, handed_out_by
from calibration.study.config.parse import parse_resolved
from calibration.study.config.schema import VIEWS
from calibration.study.config.tests import predicted, swept_test
from calibration.errors import REFUSALS, in_words
from calibration.intake.measurements import other_settings
from calibration.intake.started_code import refuse_unasked
from calibration.digests import digest
from calibration.runs.verify import made_again, refuse_outside
from calibration.runs.verify import plan_faults
from calibration.study.stage import load_stages
from calibration.chain.study import Study
from dem.experiments import experiments

# what asks and makes nothing: of a dry run alone snakemake tells the workflow
ASKS = (
    "--lint --list --rulegraph --dag --filegraph --d3dag --summary --detailed-summary"
)
# this call is no job of another, and makes something
STARTS = workflow.is_main_process and not {*ASKS.split()} & {*sys.argv}

CONFIG_FILES = list(workflow.overwrite_configfiles)

# a file with its own factors is a study of its own; any other is laid over the folder's. What a
# module is given as its `config` is whole
if not workflow.modifier.skip_configfile and not any(map(stands_alone, CONFIG_FILES)):
    CONFIG_FILES.insert(0, "config/config.yaml")

    configfile: "config/config.yaml"


if workflow.storage_settings.default_storage_provider:
    raise WorkflowError(
        "--default-storage-provider: results stand in a folder; `--config results=FOLDER` names it"
    )

# rules name paths below RESULTS as they are without the prefix that a `module` statement may ask
# for; the packages read and write them where they are
RESULTS = str(config.get("results", Config.model_fields["results"].default))
config = {**config, "results": str(workflow.modifier.modify_path(RESULTS))}

# modules that say what the page shows of a stage; those of SUPPLEMENTS count for a study that names
# one of theirs
DECLARED = ["calibration.stages", "diagnosis.declared"]
for module in globals().get("SUPPLEMENTS", []):
    if set(load_stages(module)) & set(config.get("supplements") or ()):
        DECLARED.append(module)
STAGES = load_stages(*DECLARED)
PLANS = {plan.folder: plan for stage in STAGES.values() for plan in stage.plans}

try:
    STUDY_OBJECT = Study(parse_resolved(config, CONFIG_FILES, STAGES))
    if workflow.is_main_process:
        asked = workflow.config_settings.config
        refuse_unasked(STUDY_OBJECT.config, asked, CONFIG_FILES)
        if not workflow.modifier.skip_configfile:  # a module is told by who uses it
            refuse_outside(RESULTS, asked)
except REFUSALS as error:
    raise WorkflowError(in_words(error))

SETTINGS = STUDY_OBJECT.config
STUDY, RUNS = f"{RESULTS}/{SETTINGS.name}", f"{RESULTS}/runs"


wildcard_constraints:
    experiment="|".join(experiments()),
    digest="[0-9a-f]{16}",
    batch=r"\d+",
    wave=r"\d+",


def user_file(path):
    """An input: a file of the user, which no prefix moves; [] where the study names none. Its time
    says nothing; what is in it counts, see `made_from`."""
    return ancient(local(str(path))) if path else []


def planned(folder):
    """Outputs of who plans runs: the points, and the spec of each run."""
    return {
        "design": f"{STUDY}/{folder}/design.csv",
        "plan": f"{STUDY}/{folder}/plan.json",
    }


def page(file, category, caption=None, captions="../report"):
    """An output: a file of the study that snakemake's report shows, with the caption of its name
    unless given; captions: their folder from that of the rules."""
    caption = f"{captions}/{caption or Path(file).stem}.rst"
    return report(f"{STUDY}/{file}", caption=caption, category=category)


# sections that whoever plans runs reads, and whoever reads what came out of them
PLANNING = ["seed", "experiment", "fixed", "own_run", "factors"]
TESTS = ["own", "run", "tests"]
EVERYTHING = [*Config.model_fields, *VIEWS]
RESPONSES = ["target", "measurements", "experiment", *TESTS]

# An edit of the factor table makes again the rules that have FACTORS among their input, and what
# follows (`snakemake -n` shows it); a run whose spec stays is kept. The same for MEASUREMENTS
FACTORS = user_file(SETTINGS.factors)
MEASUREMENTS = user_file(SETTINGS.measurements)
# what the bench tests found, where the configuration takes the levels of the heaps from them
BENCH_VALUES = [f"{STUDY}/bench/fixed.json"] if SETTINGS.fixed_from == "bench" else []


def complete():
    """Give each rule that calls a function of the packages the param `made_from`, the input `again`
    and, unless it has one, a log of its name. One without a benchmark takes seconds and so runs where snakemake does.
    Called after the last rule of a Snakefile."""
    for each in workflow.rules:
        named = set(each.params.keys())
        if "reads" in named and "made_from" not in named:
            each.set_input(again=again(each))
            each.set_params(made_from=made_from(each))
            if not each.log:
                each.log_modifier = each.output_modifier
                names = [each.name, *(f"{{{w}}}" for w in each.wildcard_names)]
                each.set_log(f"{STUDY}/logs/{'_'.join(names)}.log")
            if not each.benchmark:
                workflow.localrules(each.name)


def made_from(each):
    """Param of a rule, a function of the wildcards: a digest of the sections of the configuration
    that the rule reads, of the code of its packages, and of the user's files among its input.
    Snakemake makes the rule's files again when it changes.
    """

    @cache
    def content():
        params = each.params
        own = params.get("code") or params.function.split(":")[0]
        files = {str(f) for f in each.input if is_flagged(f, "local")}
        files |= {SETTINGS.measurements} if "measurements" in params.reads else set()
        named = [own, *params.get("declared", ())]
        return digest(SETTINGS, params.reads, named, sorted(files))

    return lambda wildcards: content()


def again(each):
    """Input function without files: a rule's files are made again where they are not as its record
    says, see `calibration.runs.verify`. It answers a fault of snakemake that no documented means
    mends: files of which .snakemake has no record count as current, whatever has changed.
    """

    @cache
    def stale(name, files):
        known = all(workflow.persistence.params(file) is not None for file in files)
        content = None if known else each.params.made_from({})
        plans = [p.parent for p in map(Path, files) if p.name == "plan.json"]
        faults = any(True for plan in plans for _ in plan_faults(plan))
        return faults or made_again(STUDY_OBJECT.folder, name, files, content)

    def check(wildcards):
        if STARTS:
            files, _ = each.expand_output(wildcards)
            name = Path(each.expand_log(wildcards)[0]).stem
            if stale(name, tuple(files)):
                workflow.dag.forcefiles.update(files)
        return []

    return check
