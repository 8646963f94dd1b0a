"""Files that are written so that a killed run leaves nothing that looks finished, checksums of
files and of data that carry their own, and the tables of facts that the package brings along."""

import csv
import errno
import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

DIGEST = 32  # bytes of a SHA-256
CHUNK = 1 << 20


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


def digest_of(path: str | Path, end: int | None = None) -> str:
    """SHA-256 of a file's first `end` bytes, of all unless given, as hex digits. Raises OSError."""
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        left = os.fstat(stream.fileno()).st_size if end is None else end
        while left > 0 and (chunk := stream.read(min(CHUNK, left))):
            digest.update(chunk)
            left -= len(chunk)
    return digest.hexdigest()


def sealed(data: dict[str, Any]) -> dict[str, Any]:
    """A mapping with the checksum of its content beside it; the order of keys does not count."""
    return data | {"checksum": _checksum(data)}


def is_sealed(data: object) -> bool:
    """Return whether a mapping carries the checksum of its content."""
    return isinstance(data, dict) and data.get("checksum") == _checksum(data)


def _checksum(data):
    content = {k: v for k, v in data.items() if k != "checksum"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def write_checked_arrays(path: str | Path, arrays: Mapping[str, Any]) -> None:
    """Write a mapping of arrays as .npz with its checksum behind, atomically."""

    def write(stream):
        np.savez(stream, **arrays)
        stream.flush()
        stream.write(bytes.fromhex(digest_of(stream.name)))

    replace_file(path, write)


def read_checked_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """{name: array} of a file that `write_checked_arrays` wrote. Raises OSError, and ValueError for
    a file that is not as it was written."""
    size = os.stat(path).st_size - DIGEST
    with open(path, "rb") as stream:
        stream.seek(max(size, 0))
        written = stream.read().hex()
    if size < 0 or digest_of(path, size) != written:
        raise ValueError(f"{path}: is not as it was written")
    with np.load(path) as saved:
        return {k: saved[k] for k in saved.files}
