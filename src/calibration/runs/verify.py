"""What of a study's results can no longer be trusted, and making it again.

Damage is found by checksums, a copy by the name that it carries, an edited design by what was
written down when it was planned. Nothing is deleted: what cannot be trusted is renamed to
`*.damaged` and counts as missing.

What each rule of the workflow has left is written down beside a study's files: checksums of them,
and the digest of what they were made from. This record answers two faults of snakemake. It goes by
the times of outputs and not by what is in them, so that an edited table counts as a new one. And
its own records lie in .snakemake: where results were copied without it, or it was deleted,
everything counts as current, whatever has changed. A record that is missing or damaged means that
the files are made again.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from calibration import engines
from calibration.errors import CalibrationError, ConfigError
from calibration.files import read_json, set_aside
from calibration.runs.plans import read_plan, run_id
from calibration.runs.store import RunStore
from calibration.study.config import Config
from dem.errors import DemError, ResultError
from dem.io.files import digest_of, is_sealed, sealed, write_json
from dem.results import FAILED, RESULT, is_current

FOLDER = ".made_from"
"""Folder of a study with NAME.json, the record of a rule; NAME is that of the rule's log. By it the
project knows its own folders: in one that has files and none of it, nothing is changed."""


def record(folder: str | Path, name: str, made_from: str, outputs: Iterable[str | Path]) -> None:
    """Write down what a rule has left in a study's folder.

    made_from : digest of code, settings and tables; outputs : files and folders of files
    """
    paths = [p for path in map(Path, outputs) for p in (path, *sorted(path.rglob("*")))]
    files = {os.path.relpath(p, folder): digest_of(p) for p in paths if p.is_file()}
    content = {"made_from": made_from, "files": files}
    write_json(Path(folder, FOLDER, f"{name}.json"), sealed(content))


def read_record(path: str | Path) -> dict[str, Any] | None:
    """Return a record: a mapping with `made_from` and `files` {path: SHA-256}; None where it is
    missing or damaged, or names a file that is not in its study's folder."""
    study = Path(path).parents[1]
    try:
        found = read_json(path)
    except (OSError, ValueError):
        return None
    whole = is_sealed(found) and all(inside(study, study / file) for file in found["files"])
    return found if whole else None


def inside(folder: Path, file: Path) -> bool:
    """Return whether a file lies in a folder, all links followed."""
    return file.resolve().is_relative_to(folder.resolve())


def _altered(folder, found):
    for relative, digest in found["files"].items():
        file = Path(folder, relative)
        if not (file.is_file() and digest_of(file) == digest):
            yield file


def made_again(
    folder: str | Path, name: str, outputs: Iterable[str | Path], content: str | None = None
) -> bool:
    """Return whether the files of a rule are to be made again: nothing says how they were made, one
    is not as the rule left it, or code, settings or tables of the rule have changed. content: the
    digest that its record must have, if given."""
    found = read_record(Path(folder, FOLDER, f"{name}.json"))
    if found is None:
        return any(Path(file).exists() for file in outputs)
    return any(_altered(folder, found)) or (content or found["made_from"]) != found["made_from"]


def refuse_others(folder: str | Path) -> None:
    """Raise ConfigError for the folder of a study that has files and none of the project's own
    records: somebody else's."""
    folder = Path(folder)
    if not (folder / FOLDER).is_dir() and any(p.is_file() for p in folder.rglob("*")):
        raise ConfigError(
            f"holds files that no study has made: it has no {FOLDER}",
            path=folder,
            allowed="another `name` or `results`; for a study of a version without such records, "
            f"`mkdir {folder / FOLDER}`",
        )


def refuse_outside(results: str, asked: Mapping[str, Any] | None) -> None:
    """Raise ConfigError for a folder of results that is not below the present one, unless the
    command line names it: `asked` is what `--config` gave."""
    place = Path(os.path.abspath(results))
    if not place.is_relative_to(Path.cwd()) and (asked or {}).get("results") != results:
        raise ConfigError(
            "is outside of this folder, which a configuration file may not ask for by itself",
            key="results",
            value=results,
            allowed=f"a folder below this one, or on the command line: --config results={results}",
        )


_held = {}  # type: ignore[var-annotated]  # locks that are held until this process ends, however it ends
HELD = "CALIBRATION_HELD"
"""Environment variable: the folders of results, a line each, that this process holds, or one that
waits for it."""


@dataclass(frozen=True)
class Fault:
    """What is wrong with a run (`run`, its name), or with a plan or another file that a rule wrote
    (`file`)."""

    text: str
    run: str | None = None
    file: Path | None = None
    stale: bool = False

    def __str__(self):
        return self.text


def faults_of(results: str | Path = "results") -> list[Fault]:
    """`Fault`s of all runs, plans and files of stages below a folder of results, every file
    read."""
    studies = sorted(p.parent for p in Path(results).glob(f"*/{FOLDER}"))
    found = list(_run_faults(RunStore(Path(results) / "runs"), full=True))
    return found + [fault for study in studies for fault in _study_faults(study)]


def _run_faults(store, full):
    """`Fault`s of runs; not `full`: of those that the store's index does not know as unchanged."""
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
    plan = Path(folder, "plan.json")
    try:
        specs = read_plan(plan)
    except ValueError:
        yield Fault(f"{plan}: is damaged: it holds no plan", file=plan)
        return
    for name, spec in _one_of_each_rig(specs):
        try:
            found = run_id(spec)
        except (DemError, ArithmeticError) as error:  # a number so large that its cube is none
            yield Fault(f"{plan}: {name} cannot be run: {error}", file=plan)
            continue
        if found != name:
            text = "what it reads has changed since it was planned, or it was edited"
            yield Fault(f"{plan}: {name} is now {found}: {text}", file=plan)


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


def repair(faults: Sequence[Fault], results: str | Path = "results") -> None:
    """Set aside what is wrong, so that it counts as missing and the workflow makes it again."""
    store = RunStore(Path(results) / "runs")
    for fault in faults:
        if fault.run is None:
            _set_aside(fault)
        else:
            store.set_aside(fault.run)


def _specs(plan):
    try:
        return read_plan(plan)
    except ValueError:
        return {}


def untrusted(config: Config, store: RunStore) -> tuple[list[str], list[Fault]]:
    """Return sentences on what of a study and of the store cannot be trusted, and the `Fault`s that
    are to be set aside before the study's jobs, so that none writes over them; nothing is written.
    Runs of another engine are told of by their number."""
    folder = Path(config.results, config.name)
    planned = {name for plan in _plans(folder) for name in _specs(plan)}
    own, runs = _study_faults(folder), list(_run_faults(store, full=False))
    damaged = [fault for fault in runs if not fault.stale]
    stale = [fault for fault in runs if fault.stale and fault.run in planned]
    said = [f"{fault}; it is made again" for fault in own]
    said += [f"{fault}; the run counts as missing" for fault in damaged]
    if stale:
        said.append(
            f"{len(stale)} runs of {config.name} were made by another engine; they are made again"
        )
    return said, [*own, *damaged, *stale]


def lost_runs(folder: str | Path, store: RunStore) -> list[str]:
    """Return the names of those runs of the plan in a stage's folder that are missing or cannot be
    trusted."""
    return [run for run in _specs(Path(folder, "plan.json")) if not _has(store, run)]


def _has(store, run):
    """Return whether a run is finished by this engine, or kept as failed, and can be trusted."""
    try:
        engine = store.entry(run)["engine"]
    except ResultError:
        return store.failure(run) is not None
    return is_current(engine) and not engines.changed(engine, run, store)


def _plans(folder):
    """Files of the plans in a study's folder."""
    return sorted(p for p in Path(folder).glob("**/plan.json") if inside(Path(folder), p))


def _study_faults(folder):
    """`Fault`s of the plans, the records and the files that rules have left in a study's folder."""
    found = [fault for plan in _plans(folder) for fault in plan_faults(plan.parent)]
    for path in sorted(Path(folder, FOLDER).glob("*.json")):
        left = read_record(path)
        if left is None:
            text = "is damaged, or names a file that is not in its study's folder"
            found.append(Fault(f"{path}: {text}", file=path))
        for file in _altered(folder, left) if left else ():
            text = "has changed" if file.is_file() else "is missing"
            found.append(Fault(f"{file}: {text} since {path.stem} wrote it", file=file))
    return found


def _set_aside(fault):
    """Rename the file of a fault, if it is there. One of a folder below that of its stage, as a
    deck's, goes to the stage's: snakemake deletes a folder that is a rule's output before it makes
    it again."""
    file = fault.file
    if file and file.is_file():
        above = [folder for folder in file.parents if (folder.parent / FOLDER).is_dir()]
        set_aside(file, above[0] if above else None)


def hold(results: str | Path) -> None:
    """Keep others from working in a folder of results until this process ends. Raises
    CalibrationError where another does; a call that is a job of the one that holds the folder works
    there too."""
    results, held = Path(results), os.environ.get(HELD, "")
    if str(results.resolve()) in held.splitlines():
        return
    lock = FileLock(results / ".lock")
    try:
        results.mkdir(parents=True, exist_ok=True)
        lock.acquire(blocking=False)
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
    os.environ[HELD] = "\n".join([held, str(results.resolve())])
