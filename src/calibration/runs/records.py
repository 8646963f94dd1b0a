"""What each rule of the workflow has left, written down beside a study's files: checksums of them,
and the digest of what they were made from.

It answers two faults of snakemake. It goes by the times of outputs and not by what is in them, so
that an edited table counts as a new one. And its own records lie in .snakemake: where results were
copied without it, or it was deleted, everything counts as current, whatever has changed. A record
that is missing or damaged means that the files are made again.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from calibration.errors import ConfigError
from calibration.files import read_json
from dem.io.checked import digest_of, is_sealed, sealed
from dem.io.files import write_json

FOLDER = ".made_from"
"""Folder of a study with NAME.json, the record of a rule; NAME is that of the rule's log. By it the
project knows its own folders: in one that has files and none of it, nothing is changed."""


def record(
    folder: str | Path,
    name: str,
    made_from: str,
    outputs: Iterable[str | Path],
    inputs: Iterable[str | Path] = (),
) -> None:
    """Write down what a rule has left in a study's folder.

    made_from : digest of code, settings and tables; outputs : files below the folder, of which
    folders are left out; inputs : files of the user that the rule read
    """
    files = {os.path.relpath(f, folder): digest_of(f) for f in outputs if Path(f).is_file()}
    read = {str(f): digest_of(f) for f in inputs if Path(f).is_file()}
    content = {"made_from": made_from, "files": files, "inputs": read}
    write_json(Path(folder, FOLDER, f"{name}.json"), sealed(content))


def read_record(path: str | Path) -> dict[str, Any] | None:
    """Return a record: a mapping with `made_from`, `files` and `inputs` {path: SHA-256}; None where
    it is missing or damaged, or names a file that is not in its study's folder."""
    try:
        found = read_json(path)
        whole = is_sealed(found) and isinstance(found.get("made_from"), str)
    except (OSError, ValueError):
        return None
    if not (whole and all(_digests(found.get(k)) for k in ("files", "inputs"))):
        return None
    study = Path(path).parents[1]
    return found if all(inside(study, study / file) for file in found["files"]) else None


def _digests(found):
    """Return whether something is a mapping of paths to checksums."""
    return isinstance(found, dict) and all(
        isinstance(v, str) and "\0" not in k for k, v in found.items()
    )


def inside(folder: Path, file: Path) -> bool:
    """Return whether a file lies in a folder, all links followed."""
    try:
        return file.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a name that is too long, links in a circle
        return False


def records(folder: str | Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """(name, record) of each rule of a study's folder that has one."""
    for path in sorted(Path(folder, FOLDER).glob("*.json")):
        found = read_record(path)
        if found is not None:
            yield path.stem, found


def altered(folder: str | Path) -> Iterator[tuple[str, Path]]:
    """(name, file) of each file of a study that is missing or not as its rule left it."""
    for name, found in records(folder):
        yield from ((name, file) for file in _altered(folder, found))


def _altered(folder, found):
    for relative, digest in found["files"].items():
        file = Path(folder, relative)
        if not (file.is_file() and digest_of(file) == digest):
            yield file


def changed_inputs(folder: str | Path) -> Iterator[tuple[str, Path]]:
    """(name, file) of each table of the user that has changed since a rule read it. One that is not
    at hand is left out: results may have been moved away from their study."""
    for name, found in records(folder):
        for path, digest in found["inputs"].items():
            if Path(path).is_file() and digest_of(path) != digest:
                yield name, Path(path)


def recorded(folder: str | Path, file: str | Path) -> str | None:
    """Name of the rule whose record has a file of a study's folder, or None."""
    relative = os.path.relpath(file, folder)
    return next((name for name, found in records(folder) if relative in found["files"]), None)


def made_again(
    folder: str | Path, name: str, outputs: Iterable[str | Path], content: str | None = None
) -> str | None:
    """Return why the files of a rule are to be made again, in a sentence; None where they need
    not. content: the digest that its record must have, if given."""
    found = read_record(Path(folder, FOLDER, f"{name}.json"))
    if found is None:
        there = any(Path(file).exists() for file in outputs)
        return f"{folder}, {name}: nothing says how they were made" if there else None
    if file := next(_altered(folder, found), None):
        return f"{file}: is not as {name} left it"
    if content and found["made_from"] != content:
        return f"{folder}: code, settings or tables of {name} have changed"
    return None


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
