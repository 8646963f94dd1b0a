"""Results in a storage (`--default-storage-provider`): the packages read and write local copies,
beside an index that no rule names. What the storage has and this machine has not is fetched first,
since snakemake fetches the inputs of jobs alone and a start reads plans and runs."""

from snakemake.io import get_flag_value

from calibration.runs.runner import unpack_runs
from calibration.runs.verify import FOLDER

STORED = workflow.storage_settings.default_storage_provider is not None
# jobs inherit it, and write no records of files that another machine may have made
if STORED:
    os.environ.update(RESULTS_ARE_STORED="1")
if STORED and not workflow.storage_settings.keep_storage_local:
    raise WorkflowError(
        "--default-storage-provider: add --keep-storage-local-copies, since stages read what "
        "earlier ones left (docs/install.md)"
    )


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
    folder = f"{STUDY_OBJECT.folder}/"  # of the local copies
    # the mark of this project's own, which no rule names and so no storage has
    Path(folder, FOLDER).mkdir(parents=True, exist_ok=True)
    for made in (each.output for each in workflow.rules if not each.wildcard_names):
        for file in made:
            if file.startswith(folder):
                fetch(f"{STUDY}/{file.removeprefix(folder)}")
    for plan in PLANS:
        for mark in marks_of(plan) if plan_of(plan) else ():
            copy = fetch(mark)
            if copy and copy.endswith(".tar"):
                unpack_runs(copy, SETTINGS.runs)
