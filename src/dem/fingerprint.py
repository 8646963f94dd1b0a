"""A hash of the engine's sources: what a cached run and numba's compiled code depend on."""

import hashlib
from functools import cache
from pathlib import Path


@cache
def engine_fingerprint():
    """First 16 hex digits of the SHA-256 over all of `dem`'s Python files, in order of their paths."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
