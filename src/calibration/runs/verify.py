"""What of a study's results can no longer be trusted, and making it again.

Damage is found by checksums, a copy by the name that it carries, an edited design by what was
written down when it was planned. Nothing is deleted: what cannot be trusted is renamed to
`*.damaged` and counts as missing.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock, Timeout

from calibration import engines
from calibration.errors import CalibrationError
from calibration.files import read_json, sweep_abandoned, write_text
from calibration.runs.plans import read_plan, run_id
from calibration.runs.records import FOLDER, altered, changed_inputs, note, recorded
from calibration.runs.store import RunStore
from dem.errors import DemError, ResultError
from dem.io.files import sweep_partial
from dem.results import FAILED, RESULT, is_current

if TYPE_CHECKING:
    from calibration.study.config import Config


_held = {}  # type: ignore[var-annotated]  # locks that are held until this process ends, however it ends
HELD = "CALIBRATION_HELD"
"""Environment variable: the folders of results, a line each, that this process holds, or one that
waits for it."""

MISSING = "missing_runs.txt"
"""In the folder of a plan: the runs that were missing at the last start that missed any, or the
plan itself. What was made before is older than this file and so stale: snakemake makes nothing
again that is missing while what was made from it is there."""


@dataclass(frozen=True)
class Fault:
    """What is wrong with a run (`run`, its name), with the plan in a stage's folder (`plan`), or
    with a file that a rule wrote (`made`: study's folder, name of the rule, the file)."""

    text: str
    run: str | None = None
    plan: Path | None = None
    made: tuple[Path, str, Path] | None = None
    stale: bool = False

    def __str__(self):
        return self.text


def faults_of(results: str | Path = "results", full: bool = True) -> list[Fault]:
    """`Fault`s of all runs, plans and files of stages below a folder of results; `full` reads all
    files, else only those runs that the store's index does not know as unchanged."""
    store = RunStore(Path(results) / "runs")
    plans = sorted(Path(results).glob("*/**/plan.json"))
    studies = sorted(p.parent for p in Path(results).glob(f"*/{FOLDER}"))
    return [
        *_run_faults(store, full),
        *(f for p in plans for f in plan_faults(p.parent)),
        *(f for p in plans for f in _unknown(results, p)),
        *(f for s in studies for f in _file_faults(s)),
        *(f for s in studies for f in _table_faults(s)),
    ]


def checked_runs(results: str | Path) -> int:
    """Number of runs below a folder of results that are finished or kept as failed."""
    store = RunStore(Path(results) / "runs")
    found = (store.folder(n) for n in store.names())
    return sum((f / RESULT).exists() or (f / FAILED).exists() for f in found)


def _run_faults(store, full):
    for name in store.names():
        folder = store.folder(name)
        try:
            if (folder / RESULT).exists():
                engine = store.entry(name, full)["engine"]
                if not is_current(engine):
                    yield Fault(f"{folder}: was made by another engine, {engine}", name, stale=True)
                elif changed := engines.changed(engine, name, store):
                    yield Fault(changed, name)
            elif (folder / FAILED).exists():
                store.kept_failure(name)
        except ResultError as error:
            yield Fault(str(error), name)


def plan_faults(folder: str | Path) -> Iterator[Fault]:
    """`Fault`s of the plan in a stage's folder: it cannot be read, or its runs have other names
    now, since it was edited or a mesh or a table that they read has changed."""
    folder = Path(folder)
    try:
        specs = read_plan(folder / "plan.json")
    except ValueError:
        yield Fault(f"{folder / 'plan.json'}: is damaged: it holds no plan", plan=folder)
        return
    for name, spec in _one_of_each_rig(specs):
        try:
            found = run_id(spec)
        except (DemError, ArithmeticError) as error:  # a number so large that its cube is none
            yield Fault(f"{folder / 'plan.json'}: {name} cannot be run: {error}", plan=folder)
            continue
        if found != name:
            text = "what it reads has changed since it was planned, or it was edited"
            yield Fault(f"{folder / 'plan.json'}: {name} is now {found}: {text}", plan=folder)


def _unknown(results, plan):
    """`Fault` of a plan of which no record says what it was made from."""
    study = Path(results, plan.relative_to(results).parts[0])
    if recorded(study, plan) is None:
        yield Fault(f"{plan}: nothing says what it was planned from", plan=plan.parent)


def _file_faults(study):
    """`Fault`s of the files that the rules of a study's folder wrote."""
    for name, file in altered(study):
        yield Fault(f"{file}: has changed since {name} wrote it", made=(study, name, file))


def _table_faults(study):
    """`Fault`s of files of a study that were made from a table which has changed since. Its digest
    makes the workflow make them again; here they are told of."""
    for name, file in changed_inputs(study):
        yield Fault(f"{file}: has changed since {name} read it", made=(study, name, file))


def _set_file_aside(fault):
    """Let a rule make its files again, of which one that is not as it was left is renamed."""
    study, name, file = fault.made
    if Path(study) in file.parents:
        os.replace(file, f"{file}.damaged")
    note(study, name, fault)


def _one_of_each_rig(specs):
    """A run of each rig, sizes and shape of a plan, which may be read from files: what changes one
    name changes those of the same."""
    seen = {}
    for name, spec in specs.items():
        grains = spec.get("particles")
        tables = [grains.get(k) for k in ("sizes", "clump")] if isinstance(grains, dict) else grains
        reads = json.dumps([spec.get("geometry"), tables], sort_keys=True)
        seen.setdefault(reads, (name, spec))
    return seen.values()


def repair(
    faults: Sequence[Fault], results: str | Path = "results", tell: Callable[[str], object] = print
) -> int:
    """Make runs again that are wrong, and set aside plans that are, which the workflow then makes
    again.

    Returns the number of faults that are left.
    """
    store, left = RunStore(Path(results) / "runs"), 0
    known = {n: s for p in Path(results).glob("*/**/*plan.json") for n, s in _specs(p).items()}
    for fault in faults:
        if fault.plan:
            with suppress(FileNotFoundError):  # it had two faults
                _set_plan_aside(fault.plan)
            tell(f"{fault.plan}: set aside; `snakemake` plans it again")
            continue
        if fault.made:
            with suppress(FileNotFoundError):
                _set_file_aside(fault)
            tell(f"{fault.made[2]}: `snakemake` makes again what {fault.made[1]} left")
            continue
        spec = known.get(fault.run) or _own_spec(store.folder(fault.run))  # type: ignore[arg-type]
        store.set_aside(fault.run)  # type: ignore[arg-type]
        if spec is None:
            tell(f"{fault.run}: set aside; no plan knows its spec")
            continue
        try:
            engines.make(spec, store.folder(fault.run))  # type: ignore[arg-type]
            store.entry(fault.run)  # type: ignore[arg-type]
            tell(f"{fault.run}: made again")
        except DemError as error:
            tell(f"{fault.run}: could not be made again: {error}")
            left += 1
    return left


def _specs(plan):
    try:
        return read_plan(plan)
    except ValueError:
        return {}


def _own_spec(folder):
    """The spec that a result holds, if it is still that of the folder's name."""
    try:
        spec = read_json(folder / RESULT)["spec"]
        return spec if run_id(spec) == folder.name else None
    except (OSError, ValueError, KeyError, TypeError, DemError):
        return None


def before_planning(config: Config, dry_run: bool, results: str | Path = "results") -> list[str]:
    """Before the workflow looks at what is there: set aside what cannot be trusted. Returns
    sentences that say so.

    A dry run does so too, since it would take these files for finished ones; only what another
    engine made stays where it is until a real run begins. That one holds the folder of results
    until it ends: raises CalibrationError where another has it.
    """
    if not dry_run:
        hold(results)
        sweep_abandoned(Path(results) / config.name)
        _date_back(results)
    store, said = RunStore(Path(results) / "runs"), []
    planned, stale = set(), 0
    for plan in sorted((Path(results) / config.name).glob("**/plan.json")):
        planned |= set(_specs(plan))
        faults = list(plan_faults(plan.parent))
        said += [f"{fault}; it is planned again" for fault in faults]
        if faults:
            _set_plan_aside(plan.parent)
    for fault in _file_faults(Path(results) / config.name):
        _set_file_aside(fault)
        said.append(f"{fault}; it is made again")
    for fault in _run_faults(store, full=False):
        if not fault.stale:
            store.set_aside(fault.run)
            said.append(f"{fault}; the run counts as missing")
        elif fault.run in planned:
            stale += 1
            if not dry_run:
                store.set_aside(fault.run)
    for plan in (Path(results) / config.name).glob("**/plan.json"):
        forget_batches(plan.parent, store)
        missing = [name for name in _specs(plan) if not _there(store, name)]
        if missing:
            _note(plan.with_name(MISSING), missing)
    if stale:
        said.append(
            f"{stale} runs of {config.name} were made by another engine; they are made again"
        )
    return said


def _set_plan_aside(folder):
    """Rename a plan, so that its rule plans again: without it the rule's other files are no longer
    what its record says."""
    study, plan = _study_of(folder), folder / "plan.json"
    name = recorded(study, plan)
    os.replace(plan, f"{plan}.damaged")
    _note(folder / MISSING, [plan.name])
    if name:
        note(study, name, f"{plan} was set aside")


def _study_of(folder):
    """The study's folder that the folder of a plan lies in."""
    return next((p for p in folder.parents if (p / FOLDER).is_dir()), folder.parent)


def _note(path, lines):
    """Write lines and the present time to a file, in a folder that can be written."""
    with suppress(OSError):
        write_text("\n".join([time.strftime("%Y-%m-%d %H:%M:%S"), *map(str, lines), ""]), path)


def _date_back(results):
    """Give files that are dated in the future the present time: after a clock went back snakemake
    would refuse all that is made from them."""
    now = time.time()
    for path in Path(results).rglob("*"):
        with suppress(OSError):  # a writer has just replaced it
            if path.stat().st_mtime > now:
                os.utime(path, (now, now))


def forget_batches(folder: Path, store: RunStore) -> None:
    """Delete the marks of batches in a stage's folder that lack a run which they name."""
    for mark in sorted(folder.glob("batches/*.json")):
        try:
            named = read_json(mark)["runs"]
        except (OSError, ValueError, KeyError, TypeError):
            named = None
        names = isinstance(named, list) and all(isinstance(n, str) for n in named)
        if not (names and all(_there(store, name) for name in named)):  # type: ignore[union-attr]
            mark.unlink()


def _there(store, name):
    """Whether a run is finished, or kept as failed by this engine, undamaged."""
    try:
        return bool(store.entry(name))
    except ResultError:
        return store.failure(name) is not None


def hold(results: str | Path) -> None:
    """Keep others from working in a folder of results until this process ends. Raises
    CalibrationError where another does; a call that is a job of the one that holds the folder works
    there too."""
    results = Path(results)
    held = os.environ.get(HELD, "").splitlines()
    if str(results.resolve()) in held:  # by this process, or by one that waits for this one
        return
    lock = FileLock(results / ".lock")
    try:
        results.mkdir(parents=True, exist_ok=True)
        lock.acquire(timeout=0)
    except Timeout:
        raise CalibrationError(
            f"{results.resolve()}: another study, or another call of this one, works here; wait "
            "for it, or give this study another folder of results: --config results=results-2"
        ) from None
    except OSError as error:
        raise CalibrationError(
            f"{results.resolve()}: nothing can be written here ({error.strerror}); make room or "
            "give the right to write, or work in another folder"
        ) from None
    _held[results.resolve()] = lock
    os.environ[HELD] = "\n".join([*held, str(results.resolve())])
    sweep_partial(results)
