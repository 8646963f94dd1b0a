"""The runs of a plan, for rules that wait for them and for those that make them (runs.smk). A stage
plans them (plan.json: {name of a run: spec}); each is kept under the hash of its spec in RUNS.
"""

from math import ceil

from calibration.study.cost import memory_mb
from calibration.runs.runner import batch_count, batch_of
from calibration.runs.plans import planned_spec, read_plan
from calibration.runs.store import RunStore
from calibration.runs.verify import lost_runs
from dem.spec import parse_spec

STORE = RunStore(SETTINGS.runs, looks_only=True)
MODIFIER = workflow.modifier


def spec_of(name):
    """The spec of a planned run."""
    spec = planned_spec(STUDY_OBJECT.folder, name)
    if spec is None:
        raise WorkflowError(
            f"no stage of {STUDY_OBJECT.folder} has planned the run {name}"
        )
    return spec


def memory_of(specs):
    """Memory [MB] that the largest of some runs may take, half more than is expected of its grains;
    that of none before they are planned."""
    most = max(
        specs, key=lambda spec: spec.get("particles", {}).get("count", 0), default=None
    )
    return ceil(1.5 * memory_mb(parse_spec(most).particles.count if most else 0))


def plan_of(plan):
    """{name: spec} of the runs of a plan; none of one that is damaged, which is planned again."""
    try:
        return read_plan(STUDY_OBJECT.folder / plan / "plan.json")
    except ValueError:
        return {}


def batches_of(plan):
    """Number of processes that share the runs of a plan; None where each is a job of its own."""
    count = PLANS[plan].batches
    if count is None:
        return batch_count(plan_of(plan), SETTINGS.runs_per_job)
    return count(STUDY_OBJECT) if callable(count) else count


def marks_of(plan):
    """What the batches of a plan leave when all of their runs are done."""
    return [f"{STUDY}/{plan}/batches/{n}.json" for n in range(batches_of(plan))]


def runs_of(plan):
    """Input function: what shows that all runs of a plan are done. Where the number of jobs depends
    on the plan, its rule plan_<plan> is a checkpoint.
    """

    def done(wildcards):
        if PLANS[plan].batches is None:
            getattr(checkpoints, f"plan_{plan}").get()
        marks = marks_of(plan) if batches_of(plan) else None
        if STARTS:
            workflow.dag.forcefiles.update(lost(plan, batches_of(plan)))
        return marks or [f"{RUNS}/{name}/result.json" for name in plan_of(plan)]

    return done


@cache
def lost(plan, batches):
    """What shows that runs of a plan are done which are not, as this process found them: snakemake
    makes nothing again that is missing while what was made from it is there."""
    found = lost_runs(STUDY_OBJECT.folder / plan, STORE)
    where = f"{RUNS}/{{}}/result.json"
    if batches:
        shares = batch_of(plan_of(plan), batches)
        found = {shares[name] for name in found}
        where = f"{STUDY}/{plan}/batches/{{}}.json"
    return [str(MODIFIER.modify_path(where.format(name))) for name in found]
