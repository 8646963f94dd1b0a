"""Cached runs inside the workflow: the log of one, its failure in a few sentences, the campaign's
progress, and batches.

Short runs share a process: a run of two seconds would otherwise wait as long for Python to start.
Each is still kept under the content of its spec and skipped where its result is there, so that a
batch that was cut off goes on where it stopped.
"""

import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from calibration import engines
from calibration.engines.templates import macros
from calibration.errors import in_words, of_the_machine
from calibration.files import write_text
from calibration.intake.started_code import permit
from calibration.runs.plans import points_of, read_plan
from calibration.runs.progress import REPEAT, cores, progress
from calibration.runs.store import REFUSED, RunStore
from calibration.study.config import Config
from calibration.study.cost import LEAST_JOBS, START_S, run_seconds
from dem.errors import PHYSICAL, DemError, MeasureError, StoppedError
from dem.io.files import write_arrays, write_json
from dem.results import RESULT, STATE, write_failure, write_result
from dem.spec import parse_spec

# of a run: snakemake shows the log of a failed run, whose last lines must not be lost among notes
NOTE_EVERY = 0.1
REPORT_EVERY = 5.0  # seconds
WATCH_EVERY = 30.0  # seconds
SPREAD_FROM = 1.25  # radii of a lifted cylinder within which the grains of a heap do not all lie


def run_each(
    specs: Mapping[str, dict[str, Any]],
    config: Mapping[str, Any],
    note: Callable[[str], object] = lambda text: None,
    kept: bool = False,
) -> None:
    """Make runs {name: spec} of the study of a checked configuration (a mapping) one after another
    in this process; those that are there are not made again. note: takes of each how it ended;
    kept: whether one that fails physically is kept as failed.json, for a stage that goes on without
    it.

    The progress of a run is in the log in its folder. A run that fails says which points of which
    designs need it, why it failed, the likely cause and where its log is. It keeps its spec beside
    the log. It does not stop the others, but ends the job with status 1 after them; where the
    machine refuses, or the job is to stop, no further run begins.
    """
    config = Config.model_validate(config)
    permit(config)
    store, failed = RunStore(config.runs), 0
    for name, spec in specs.items():
        if store.current(name) or (kept and store.failure(name)):
            note(f"{name} was there")
            continue
        error = _fault(spec, name, config, store, kept)
        stopped = isinstance(error, StoppedError)
        ended = "failed" if kept and store.failure(name) else "done"
        note(f"{name} {ended if not error else error if stopped else f'failed: {error}'}")
        failed += bool(error)
        if stopped or (error and of_the_machine(error)):
            break  # the next run would meet the same
    if failed:
        sys.exit(1)


def _fault(spec, name, config, store, kept):
    """Make one run; what went wrong, which has been told, or None."""
    try:
        return _attempt(spec, name, config, store, kept)
    except OSError as error:  # the log itself
        print(f"run {name}: {in_words(error)}", file=sys.stderr)
        return error


def _attempt(spec, name, config, store, kept):
    out, started, told = store.folder(name), time.time(), -1.0
    out.mkdir(parents=True, exist_ok=True)
    log, repeat = out / "run.log", out / REPEAT
    with open(log, "w") as stream:

        def note(fraction, text):
            nonlocal told
            if fraction < told + NOTE_EVERY:
                return
            told = fraction
            stream.write(f"{time.time() - started:8.1f} s  {100 * fraction:3.0f} %  {text}\n")
            stream.flush()

        try:
            ending = _made(spec, out, note, config, kept)
            if (out / RESULT).exists():
                store.entry(name)
        except StoppedError as error:  # no failure: it goes on when the study does
            print(f"run {name}: {error}", file=sys.stderr)
            stream.write(f"{error}\n")
            return error
        except Exception as error:
            message = failure(error, spec, name, config)
            print(
                f"{message}\n  log:    {log}\n  repeat: dem run {repeat} --out DIR", file=sys.stderr
            )
            stream.write(f"{message}\n")
            if not (isinstance(error, DemError) or of_the_machine(error)):
                traceback.print_exc(file=stream)
            write_text(yaml.safe_dump(spec, sort_keys=False), repeat)
            return error
        stream.write(f"{ending}\n")
    repeat.unlink(missing_ok=True)
    report_sometimes(config, store)
    return None


def _made(spec, out, note, config, kept=False):
    """Make the run; returns what its log says at the end. A run that cannot be measured, as a heap
    that did not form or whose funnel clogged, is kept as a result without metrics, which the
    designs leave out by name: it never counts as a value, and it does not stop the study. `kept`:
    so is one that became unphysical, both as failed.json."""
    try:
        return f"done: {engines.make(spec, out, note, again=False)['metrics']}"
    except PHYSICAL as error:
        if kept:
            write_failure(out, parse_spec(spec), error)
            return f"failed: {error}"
        if not isinstance(error, MeasureError):
            raise
        if not (Path(out) / STATE).exists():
            write_arrays(Path(out) / STATE, engines.NO_GRAINS)
        refused = {"kind": getattr(error, "kind", "unmeasured"), "reason": str(error)}
        write_result(Path(out), parse_spec(spec), {}, {REFUSED: refused})
        with np.load(Path(out) / STATE) as state:
            position = state["position"]
        message = failure(error, spec, Path(out).name, config, "gives no value", position)
        print(message, file=sys.stderr)
        return message


def failure(
    error: BaseException,
    spec: dict[str, Any],
    name: str,
    config: Config,
    what: str = "failed",
    position: np.ndarray | None = None,
) -> str:
    """Return what a user needs to know of a run without a value: the reason, the likely cause and
    the points that need it. position (n, 3) [m]: where its grains lie at the end, if it came
    there."""
    text = in_words(error)
    lines = [f"run {name} {what}: {text}"]
    lines += [f"  likely cause: {cause}" for cause in causes(error, spec, position)]
    lines += [f"  point:  {point}" for point in points_of(name, config)]
    return "\n".join(lines)


def causes(
    error: BaseException, spec: dict[str, Any], position: np.ndarray | None = None
) -> list[str]:
    """Likely causes that the error does not name itself: no heap, and what was risky in the spec
    from the start. position: as of `failure`."""
    from dem.advice import warnings_of  # loads the engine, which takes a second

    said = macros("calibration.runs", "said")
    cause = said.no_heap() if spec.get("experiment") == "heap" else said.spread()
    if position is not None and _stands(spec, position):
        cause = said.stands()
    found = [cause] if isinstance(error, MeasureError) and "no heap" in str(error) else []
    try:
        return found + warnings_of(parse_spec(spec))
    except DemError:
        return found  # the spec itself is what failed


def _stands(spec, position):
    """Return whether grains at `position` (n, 3) [m] have kept the shape of a cylinder that was
    lifted off them."""
    width = (spec.get("geometry") or {}).get("cylinder_diameter_mm")
    if not width or not len(position):  # no other heap has a cylinder
        return False
    furthest = float(np.hypot(*position[:, :2].T).max())
    return furthest < SPREAD_FROM * 0.5e-3 * width


def begin(config: Config, store: RunStore, dry_run: bool) -> None:
    """Before the workflow plans its jobs: try every spec that the configuration decides, and say
    what cannot be trusted, what a run costs and how far the campaign is. store: one that only
    looks, as a dry run writes nothing.

    Raises CalibrationError where a spec cannot be run, where the study's folder is another's, or
    where another call works there.
    """
    # what only the start of a campaign needs takes a second to load
    from calibration.runs.feasibility import check_ahead, cost_ahead
    from calibration.runs.verify import hold, refuse_others, repair, untrusted

    check_ahead(config)
    refuse_others(Path(config.results, config.name))
    if not dry_run:
        hold(config.results)
        store = RunStore(config.runs)
    said, faults = untrusted(config, store)
    for sentence in [*said, cost_ahead(config)]:
        print(sentence, file=sys.stderr)
    if not dry_run:
        repair(faults, config.results)
    report(config, store)


def report_sometimes(config: Config, store: RunStore) -> None:
    """`report`, unless one of the jobs has just done so: in a long campaign of short runs it would
    cost more than they do."""
    stamp = Path(config.results, config.name, ".reported")
    try:
        if 0 <= time.time() - stamp.stat().st_mtime < REPORT_EVERY:
            return
    except OSError:
        pass  # the first
    stamp.parent.mkdir(parents=True, exist_ok=True)
    stamp.touch()
    report(config, store)


def watch(config: Config) -> None:
    """Print how far the campaign is whenever that has changed, in a thread that ends with this
    process: jobs on other machines print it to logs that nobody sees."""

    def tell():
        store, told = RunStore(config.runs), None
        while True:
            time.sleep(WATCH_EVERY)
            said = sentence(config, store)
            if said != told:
                print(said, file=sys.stderr, flush=True)
            told = said

    threading.Thread(target=tell, daemon=True).start()


def report(config: Config, store: RunStore | None = None) -> None:
    """Print how far the campaign is; the runs of stages not yet planned are counted as expected.
    store: the `RunStore` of who has one open."""
    print(sentence(config, store), file=sys.stderr, flush=True)


def sentence(config: Config, store: RunStore | None = None) -> str:
    """How far the campaign is, with the study's name."""
    return f"{config.name}: {progress(config, store).sentence(cores())}"


ADDED_S, ADDED_SHARE = 0.03, 0.02
"""What the start may add to a run: seconds, or a share of the run's own time if that is more. With
planning, checking and writing the workflow then adds less than 50 ms."""


def batch_count(specs: Mapping[str, dict[str, Any]], chosen: int | None = None) -> int | None:
    """Number of processes that make the runs {name: spec} of a plan, `chosen` runs each, or so many
    that their starts cost little beside the runs. None where each run is a job of its own: where a
    run takes minutes, where the plan has few runs and these are worth the starts, or where nobody
    knows what a run takes.

    A multiple of LEAST_JOBS, or one of its divisors, unless `chosen`: of 34 heaps in nine jobs of
    two cores, one core would wait while the other makes the last four."""
    if chosen:
        return ceil(len(specs) / chosen) if chosen > 1 else None
    seconds = _seconds_of_each(specs)
    if not seconds or None in seconds:
        return None
    jobs = LEAST_JOBS
    while jobs > 1 and jobs * START_S > sum(seconds):
        jobs //= 2
    bearable = sum(max(ADDED_S, ADDED_SHARE * s) for s in seconds) / START_S
    if bearable >= len(specs) or 2 * jobs > len(specs):
        return None
    return max(jobs, min(int(bearable), len(specs) // 2) // LEAST_JOBS * LEAST_JOBS)


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


def batch_of(names: Iterable[str], batches: int) -> dict[str, int]:
    """{run: number of the process that makes it} of the runs of a plan."""
    return {name: n % batches for n, name in enumerate(sorted(names))}


def run_batch(
    plan_file: str | Path,
    batch: int,
    batches: int,
    done: str | Path,
    log: str | Path,
    config: Mapping[str, Any],
    kept: bool = False,
) -> None:
    """Make every `batches`-th run of a plan, from number `batch` on, as `run_each` does, and write
    their names to `done`; `log` says of each how it ended."""
    try:
        specs = read_plan(plan_file)
        own = {name: specs[name] for name, n in batch_of(specs, batches).items() if n == batch}
        with open(log, "w", buffering=1) as stream:
            run_each(own, config, lambda text: print(text, file=stream), kept)
        write_json(done, {"runs": list(own)})
    except OSError as error:
        sys.exit(in_words(error))
