"""What a rule's result depends on beside its files: the code, the libraries and the sections of the
configuration that it reads.

The code is that of whole packages as it stands: after an edit all stages are made again, which
takes seconds beside their runs. Runs are not among these rules: their spec and the engine name
them.
"""

import ast
import hashlib
import json
import re
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pydantic import BaseModel
from pydantic_core import to_jsonable_python

from dem.fingerprint import code_of, engine_fingerprint
from dem.io.files import digest_of

SOURCES = Path(__file__).parents[1]
PACKAGES = ("dem", "calibration", "diagnosis", "paper")
"""The project's own, each importing those before it; every stage has the first two."""
COUNTED = {".py", ".j2", ".json", ".csv", ".yaml", ".mplstyle"}
LIBRARIES = (
    "numpy", "scipy", "pandas", "scikit-learn", "emcee", "pyDOE3", "matplotlib", "pillow", "pint",
    "jinja2",
)  # fmt: skip
"""Distributions that compute or draw what a stage leaves. numba computes runs, which hold it."""
TO_OTHER_CODES = {"exports", "left_out", "dispensable"}
"""What a `Law` says of other codes: no run of our own engine depends on it."""


def digest(
    config: BaseModel, sections: Iterable[str], names: Iterable[str], files: Iterable[str | Path]
) -> str:
    """First 12 hex digits of a hash of sections of a `Config`, the libraries' versions, the
    packages of the modules `names` with those that they import, and what `files` hold; one that is
    missing counts as such."""
    values = to_jsonable_python({name: getattr(config, name) for name in sections})
    last = max(1, *(PACKAGES.index(name.split(".")[0]) for name in names))
    held = [digest_of(f) if Path(f).is_file() else "" for f in files]
    parts = [json.dumps(values, sort_keys=True), *map(_version, LIBRARIES), *held]
    return _hash(*parts, *(package_digest(SOURCES / p) for p in PACKAGES[: last + 1]))


@cache
def package_digest(folder: Path) -> str:
    """Hash of the names and bytes of the modules, templates and tables below a folder."""
    found = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.suffix in COUNTED):
        found.update(f"{path.relative_to(folder).as_posix()}\n".encode())
        found.update(path.read_bytes())
    return found.hexdigest()


@cache
def adapter_digest(folder: Path) -> str:
    """First 12 hex digits of a hash of the code and templates below a folder, without comments,
    docstrings and layout, of the engine, and of what the laws say of other codes: what decides the
    runs of another code. conversion.j2 has words about a deck alone."""
    laws = [p.read_text("utf-8") for p in sorted((SOURCES / "dem/contact").rglob("*.py"))]
    parts = [node for law in laws for node in ast.walk(ast.parse(law))]
    said = [ast.unparse(p) for p in parts if getattr(p, "arg", None) in TO_OTHER_CODES]
    code = [code_of(p.read_text("utf-8")) for p in sorted(folder.rglob("*.py"))]
    texts = [p.read_text("utf-8") for p in sorted(folder.rglob("*.j2")) if p.stem != "conversion"]
    decks = [re.sub(r"\{#.*?#\}", "", text, flags=re.DOTALL) for text in texts]
    return _hash(engine_fingerprint(), *said, *code, *decks)


@cache
def _version(distribution):
    try:
        return version(distribution)
    except PackageNotFoundError:  # a copy without metadata
        return "unknown"


def _hash(*parts):
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]
