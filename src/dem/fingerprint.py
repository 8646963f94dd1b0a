"""A hash of the engine's sources: what a cached run and numba's compiled code depend on."""

import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent
OUTSIDE = {
    "cli.py",
    "template.py",
    "advice.py",
    "benchmark",
    "render",
}  # no run's result depends on these


def engine_sources():
    """Paths of the sources that a run's result depends on, in order."""
    return [p for p in sorted(ROOT.rglob("*.py")) if not OUTSIDE & set(p.relative_to(ROOT).parts)]


@cache
def engine_fingerprint():
    """First 16 hex digits of the SHA-256 over `engine_sources`."""
    digest = hashlib.sha256()
    for path in engine_sources():
        digest.update(path.relative_to(ROOT).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
