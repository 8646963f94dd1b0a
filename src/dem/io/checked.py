"""Checksums: of files, and of data that carry their own."""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dem.io.files import replace_file

DIGEST = 32  # bytes of a SHA-256
CHUNK = 1 << 20


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
