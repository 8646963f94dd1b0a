"""Files that are written so that a killed run leaves nothing that looks finished, and the tables of
facts that the package brings along."""

import csv
import errno
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np


def replace_file(path: str | Path, write: Callable[[Any], object]) -> None:
    """Write a file by write(stream) under another name and put it in the place of `path`, all or
    nothing, through a power cut as well: file and folder are on the disk when this returns."""
    path = Path(path)
    new = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with open(partial, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
    for folder in (path.parent, *(made.parent for made in new)):
        sync_folder(folder)


def sync_folder(folder: str | Path) -> None:
    """Put a folder's names on the disk, where the system can: a file that was renamed keeps its old
    name through a power cut until then."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some shared file systems sync none
            raise
    finally:
        os.close(handle)


def sweep_partial(folder: str | Path) -> None:
    """Delete what writers that were killed have left in a folder; nobody may be writing into it."""
    for partial in Path(folder).glob(".*.partial"):
        partial.unlink(missing_ok=True)


def write_json(path: str | Path, data: Mapping[str, Any] | Sequence[Any]) -> None:
    """Write a mapping or a list as JSON, atomically; NaN is refused."""
    text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    replace_file(path, lambda stream: stream.write(text.encode()))


def write_arrays(path: str | Path, arrays: Mapping[str, Any]) -> None:
    """Write a mapping of arrays as .npz, atomically."""
    replace_file(path, lambda stream: np.savez(stream, **arrays))


def rows_of(path: str | Path) -> list[dict[str, str]]:
    """Rows of a table (CSV) of the package, each {column: text}."""
    with open(path, encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))
