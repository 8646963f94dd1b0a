"""What a rule's result depends on beside its files: the code and the sections of the configuration
that it reads.

The code is found from the imports, beginning with the module of the rule's function and that of
the study, and so are the libraries, whose versions count. Comments, docstrings and layout do not
count. Runs are not among these rules: their spec and the engine name them.
"""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from dem.fingerprint import SAID, code_of
from dem.io.checked import digest_of

if TYPE_CHECKING:
    from pydantic import BaseModel


SOURCES = Path(__file__).parents[1]
PACKAGES = ("calibration", "dem", "diagnosis", "paper")
"""The project's own: where a wheel is installed, all other packages lie beside them."""
DOCUMENTED = {"equation", "source"}  # of a law: read by the documentation alone
FINDS_BY_ITSELF = {
    "iter_modules": ("*.py", "*/__init__.py"),
    '.glob("*.py")': ("**/*.py",),
}
"""What stands in a module that finds the modules beside it, and which these are."""
LIBRARIES = {
    "numpy": "numpy", "scipy": "scipy", "pandas": "pandas", "sklearn": "scikit-learn",
    "emcee": "emcee", "SALib": "SALib", "pyDOE3": "pyDOE3", "matplotlib": "matplotlib",
    "PIL": "pillow", "pint": "pint", "jinja2": "jinja2",
}  # fmt: skip
"""Name that is imported: distribution. numba is left out: it computes runs, which hold it."""
OWN = Path(__file__).name  # where these words stand and nothing is found


def digest(
    config: BaseModel, sections: Iterable[str], names: Iterable[str], sources: str | Path = SOURCES
) -> str:
    """First 12 hex digits of a hash of sections of a `Config` and of the code that importing the
    modules `names` brings in; sources: the folder of the packages."""
    values = config.model_dump(mode="json", include=set(sections))
    files = {path for name in names for path in modules(name, Path(sources))}
    return _hash([json.dumps(values, sort_keys=True), *libraries(files)], files)


def libraries(files: Iterable[Path]) -> list[str]:
    """["name version"] of the packages of others that sources import, in order: those among
    LIBRARIES, which compute or draw what a stage leaves."""
    names = {name for path in files if path.suffix == ".py" for name in _names(path)}
    return [f"{d} {_version(d)}" for d in sorted({LIBRARIES[n] for n in names & set(LIBRARIES)})]


@cache
def _version(distribution):
    try:
        return version(distribution)
    except PackageNotFoundError:  # a copy without metadata
        return "unknown"


@cache
def _names(path):
    """Top names of what a module imports, at whatever place in it."""
    tree = ast.parse(path.read_text())
    found = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    found |= {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    return frozenset(name.split(".")[0] for name in found)


def code_digest(name: str, packages: Iterable[str], sources: Path = SOURCES) -> str:
    """First 12 hex digits of a hash of the code of `packages` that importing a module brings in."""
    roots = [sources.joinpath(*package.split(".")) for package in packages]
    files = {p for p in modules(name, sources) if any(root in p.parents for root in roots)}
    return _hash([], files)


def _hash(parts, files):
    parts += [_content(path, path.stat().st_mtime_ns) for path in sorted(files)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


def digest_with(code: str, files: Iterable[str | Path]) -> str:
    """A `digest` and what files hold; one that is missing counts as such."""
    parts = [code, *(digest_of(f) if Path(f).is_file() else "" for f in files)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


@cache
def modules(name: str, sources: Path = SOURCES) -> set[Path]:
    """Files that importing the module `name` of the project brings in, itself among them, and the
    data files of their packages."""
    found, left = set(), [_file(name, sources)]
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            left += _imported(path, sources)
    return found | {data for path in found for data in _data_beside(path)}


@cache
def _imported(path, sources):
    """Files of the project that a module imports, and those that it finds by itself."""
    text = path.read_text()
    tree, found = ast.parse(text), set()
    # what is imported for a type checker alone decides no result
    for branch in (n for n in ast.walk(tree) if _for_types(n)):
        branch.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {_file(alias.name, sources) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {_source(node.module, alias.name, sources) for alias in node.names}
    patterns = [p for word, them in FINDS_BY_ITSELF.items() if word in text for p in them]
    if path.name != OWN:
        found |= {file for pattern in patterns for file in path.parent.glob(pattern)}
    return frozenset(found - {None})


def _for_types(node):
    return isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"


def _source(module, name, sources):
    """File that `from module import name` takes the name from: a module of that name, or where a
    package only passes the name on, the module that has it."""
    inside, path = _file(f"{module}.{name}", sources), _file(module, sources)
    if inside or path is None or path.name != "__init__.py":
        return inside or path
    return _passed_on(path, sources).get(name, path)


@cache
def _passed_on(package, sources):
    """{name: file} of the names that a package takes from its modules."""
    return {
        alias.asname or alias.name: _source(node.module, alias.name, sources)
        for node in ast.parse(package.read_text()).body
        if isinstance(node, ast.ImportFrom) and _file(node.module, sources)
        for alias in node.names
    }


@cache
def _file(name, sources):
    """File of a module of the project, None for another's."""
    parts = (name or "").split(".")
    if parts[0] not in PACKAGES:
        return None
    place = sources.joinpath(*parts)
    files = place.with_suffix(".py"), place / "__init__.py"
    return next((path for path in files if path.is_file()), None)


def _data_beside(path):
    """Templates, schemas and tables that belong to the package of a module."""
    return [p for p in path.parent.iterdir() if p.suffix in (".j2", ".json", ".csv")]


@cache
def _content(path, _changed):
    """What counts of a file; many tasks share it."""
    text = path.read_text()
    return f"{code_of(text)}\n{_for_other_codes(text)}" if path.suffix == ".py" else text


def _for_other_codes(text):
    """What a law's file says of other codes, which `code_of` leaves out: no run depends on it, the
    exports do."""
    said = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.keyword))
    return "\n".join(ast.unparse(node.value) for node in said if node.arg in SAID - DOCUMENTED)
