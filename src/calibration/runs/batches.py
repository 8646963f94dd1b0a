"""Short runs, many to a process: a run of two seconds would otherwise wait as long for Python to
start.

Each run is still kept under the content of its spec and skipped where its result is there, so that
a batch that was cut off goes on where it stopped.
"""

import sys
import tarfile
from collections.abc import Callable, Mapping
from math import ceil
from pathlib import Path, PurePosixPath
from typing import Any

from calibration.errors import CalibrationError, in_words
from calibration.files import read_json
from calibration.runs.plans import read_plan
from calibration.runs.runner import run_each
from calibration.runs.simulated import simulate
from calibration.runs.store import RunStore
from calibration.study.cost import LEAST_JOBS, START_S, run_seconds
from dem.io.files import write_json

ADDED_S, ADDED_SHARE = 0.03, 0.02
"""What the start may add to a run: seconds, or a share of the run's own time if that is more. With
planning, checking and writing the workflow then adds less than 50 ms."""


def runs_per_job(specs: Mapping[str, dict[str, Any]], chosen: int | None = None) -> int:
    """Number of runs {name: spec} of a plan that share a process: `chosen`, or as many as make the
    start of a process cost little beside them. One where a run takes minutes, where the plan has
    few runs and these are worth the starts, or where nobody knows what a run takes."""
    if chosen:
        return chosen
    seconds = _seconds_of_each(specs)
    if not specs or None in seconds:
        return 1
    bearable = sum(max(ADDED_S, ADDED_SHARE * s) for s in seconds) / len(seconds)
    return max(1, min(ceil(START_S / bearable), len(specs) // _least_jobs(sum(seconds))))


def _seconds_of_each(specs):
    """Estimated time [s] of each run, or None. One is asked of each experiment and number of
    grains."""
    known, found = {}, []
    for spec in specs.values():
        kind = spec["experiment"], spec.get("particles", {}).get("count")
        if kind not in known:
            known[kind] = run_seconds(spec)
        found.append(known[kind])
    return found


def _least_jobs(seconds):
    """LEAST_JOBS, or the largest of 4, 2 and 1 whose starts take less than the runs' `seconds`."""
    jobs = LEAST_JOBS
    while jobs > 1 and jobs * START_S > seconds:
        jobs //= 2
    return jobs


def batch_count(specs: Mapping[str, dict[str, Any]], chosen: int | None = None) -> int | None:
    """Number of processes that make the runs of a plan; None where each run is a job of its own. A
    multiple of LEAST_JOBS, or one of its divisors, unless `chosen`: of 34 heaps in nine jobs of two
    cores, one core would wait while the other makes the last four."""
    size = runs_per_job(specs, chosen)
    if size == 1:
        return None
    jobs = ceil(len(specs) / size)
    if chosen:
        return jobs
    even = jobs - jobs % LEAST_JOBS
    return even or 1 << (jobs.bit_length() - 1)


def run_batch(
    plan_file: str | Path,
    batch: int,
    batches: int,
    done: str | Path,
    failures: str = "refused",
    root: str | Path | None = None,
    tell: Callable[[], object] = lambda: None,
) -> None:
    """Do every `batches`-th run of a plan, from number `batch` on, and write their names to `done`.

    failures: "refused" raises CalibrationError naming the runs that failed and why, after the
    others have been done; "kept" lists them in `done`, for who can do without them. What the
    machine did to a run is refused in either case. tell: called after each run."""
    specs = share_of(plan_file, batch, batches)

    def note(text):
        print(text, flush=True)
        tell()

    found = simulate(specs, root, note)
    failed = [name for name, metrics in found.items() if metrics is None]
    if failed and failures == "refused":
        store = RunStore(root)
        lines = [f"{n}: {(store.failure(n) or {}).get('error', '')}" for n in failed]
        raise CalibrationError(f"{len(failed)} runs of {plan_file} failed\n" + "\n".join(lines))
    write_json(done, {"runs": list(specs), "failed": failed})


def run_told_batch(
    plan_file: str | Path,
    batch: int,
    batches: int,
    done: str | Path,
    log: str | Path,
    config: Mapping[str, Any],
    root: str | Path | None = None,
) -> None:
    """The same for runs that could each be a job of its own: each has its log and its message, and
    the job ends with status 1 after them where one failed; see `run_each`."""
    try:
        specs = share_of(plan_file, batch, batches)
        run_each(specs, log, config, root)
        write_json(done, {"runs": list(specs), "failed": []})
    except OSError as error:
        sys.exit(in_words(error))


def pack_runs(done: str | Path, archive: str | Path, root: str | Path | None = None) -> None:
    """Put the folders of the runs that a batch left `done` into one file."""
    store = RunStore(root)
    with tarfile.open(archive, "w") as tar:
        for name in read_json(done)["runs"]:
            tar.add(store.folder(name), name)


def unpack_runs(archive: str | Path, root: str | Path | None = None) -> None:
    """Put the runs of an archive where they are kept. Raises CalibrationError for one that is
    broken."""
    try:
        with tarfile.open(archive) as tar:
            if odd := next((m.name for m in tar if not _of_a_run(m)), None):
                raise CalibrationError(f"{archive}: holds {odd}, which is no file of a run")
            # Python 3.11.3 and older know no filter and extract as they always did
            tar.extraction_filter = getattr(tarfile, "data_filter", None)
            tar.extractall(RunStore(root).folder("."))
    except tarfile.TarError as error:
        raise CalibrationError(f"{archive}: {error}") from None


def _of_a_run(member):
    """Return whether a member of an archive is a file or a folder below the archive's root."""
    path = PurePosixPath(member.name)
    below = not path.is_absolute() and ".." not in path.parts
    return below and (member.isfile() or member.isdir())


def share_of(plan_file: str | Path, batch: int, batches: int) -> dict[str, dict[str, Any]]:
    """{run id: spec} of every `batches`-th run of a plan, from number `batch` on."""
    specs = read_plan(plan_file)
    return {name: specs[name] for name in sorted(specs)[batch::batches]}
