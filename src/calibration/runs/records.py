"""What each rule of the workflow has left, written down beside a study's files: checksums of them,
and the digest of what they were made from.

It answers two faults of snakemake. It goes by the times of outputs and not by what is in them, so
that an edited table counts as a new one. And its own records lie in .snakemake: where results were
copied without it, or it was deleted, everything counts as current, whatever has changed. A record
that is missing or damaged means that the files are made again.
"""

import os
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from calibration.files import read_json, write_text
from dem.io.checked import digest_of, is_sealed, sealed
from dem.io.files import write_json

FOLDER = ".made_from"
"""Folder of a study with NAME.json, the record of a rule, and NAME.txt, a note why its files are to
be made again. NAME is that of the rule's log."""


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
    """A record: a mapping with `made_from`, `files` and `inputs` {path: SHA-256}; None where it is
    missing or damaged."""
    try:
        found = read_json(path)
        whole = is_sealed(found) and isinstance(found.get("made_from"), str)
    except (OSError, ValueError):
        return None
    return found if whole and all(_digests(found.get(k)) for k in ("files", "inputs")) else None


def _digests(found):
    """Whether something is a mapping of paths to checksums."""
    return isinstance(found, dict) and all(
        isinstance(v, str) and "\0" not in k for k, v in found.items()
    )


def records(folder: str | Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """(name, record) of each rule of a study's folder that has one."""
    for path in sorted(Path(folder, FOLDER).glob("*.json")):
        found = read_record(path)
        if found:
            yield path.stem, found


def altered(folder: str | Path) -> Iterator[tuple[str, Path]]:
    """(name, file) of each file of a study that is not as its rule left it."""
    for name, found in records(folder):
        for relative, digest in found["files"].items():
            file = Path(folder, relative)
            if file.is_file() and digest_of(file) != digest:
                yield name, file


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


def note(folder: str | Path, name: str, reason: str) -> None:
    """Write down that the files of a rule are to be made again; a folder that can only be read
    stays as it is. Its time is what counts: it is newer than they are."""
    with suppress(OSError):
        text = f"{time.strftime('%Y-%m-%d %H:%M:%S')}\n{reason}\n"
        write_text(text, Path(folder, FOLDER, f"{name}.txt"))


def made_again(
    folder: str | Path,
    name: str,
    outputs: Iterable[str | Path],
    content: str | None = None,
) -> str:
    """Path, within a study's folder, of the note that the files of a rule are to be made again; it
    is written where one of them is there and no record says how it was made, or one that differs
    from the digest `content`, if that is given."""
    if any(Path(file).exists() for file in outputs):
        found = read_record(Path(folder, FOLDER, f"{name}.json"))
        if found is None:
            note(folder, name, "nothing says how they were made")
        elif content and found["made_from"] != content:
            note(folder, name, "code, settings or tables have changed")
    return f"{FOLDER}/{name}.txt"
