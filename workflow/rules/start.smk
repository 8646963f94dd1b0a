"""What happens before the first job and after the last one: the study is checked, what cannot be
trusted is told and set aside, and how far the study is, is said. A dry run sets nothing aside, and
a call that only asks, as `--lint`, looks at nothing.
"""

from calibration.telling.sentences import closing, opening
from calibration.runs.runner import begin, watch
from calibration.runs.plans import plans_of
from calibration.runs.runner import report as report_progress

# the runs' progress divides the work by this; it is no parameter of any run. A cluster's profile
# names jobs at once, and so does -j in a dry run
SHARED_BY = max(
    workflow.resource_settings.cores or 1, workflow.resource_settings.nodes or 1
)
os.environ.update(CAMPAIGN_CORES=str(SHARED_BY))

if STARTS:
    try:
        print(*opening(SETTINGS), sep="\n", file=sys.stderr)
        begin(SETTINGS, STORE, dry_run=workflow.output_settings.dryrun)
    except REFUSALS as error:
        raise WorkflowError(in_words(error))


onstart:
    print(
        "Ctrl-C stops; the same command goes on where it stopped", file=sys.stderr
    )
    if workflow.non_local_exec:
        watch(SETTINGS)


onsuccess:
    # a diagnosis of single contacts plans none of the study's runs
    if workflow.output_settings.dryrun or any(runs for _, runs in plans_of(STUDY)):
        report_progress(SETTINGS)
    for sentence in closing(STUDY_OBJECT):
        print(sentence, file=sys.stderr)
