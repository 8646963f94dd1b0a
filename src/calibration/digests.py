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

from dem.fingerprint import SAID, kept_code
from dem.io.checked import digest_of
from dem.source_readings import Readings

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
    "emcee": "emcee", "pyDOE3": "pyDOE3", "matplotlib": "matplotlib",
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
    return frozenset(name.split(".")[0] for name in _kept(path.read_text("utf-8"))["names"])


def said_in(text: str) -> dict[str, list]:
    """What counts of a module beside its code, each in order:

    names : modules that it imports, at whatever place in it
    imports : [module, name or None] of each import that is not for a type checker alone
    passed_on : [module, name, name here] of what is imported at the module's own level
    of_other_codes : what a law's file says of other codes, which `code_of` leaves out: no run
        depends on it, the exports do
    """
    tree = ast.parse(text)
    said = [n for n in ast.walk(tree) if isinstance(n, ast.keyword) and n.arg in SAID - DOCUMENTED]
    own = [n for n in tree.body if isinstance(n, ast.ImportFrom)]
    names = {module or "" for module, _ in _imports(tree)}
    for branch in ast.walk(tree):
        if isinstance(branch, ast.If) and getattr(branch.test, "id", "") == "TYPE_CHECKING":
            branch.body = []
    return {
        "names": sorted(names),
        "imports": _imports(tree),
        "passed_on": [[n.module, a.name, a.asname or a.name] for n in own for a in n.names],
        "of_other_codes": [ast.unparse(keyword.value) for keyword in said],
    }


def _imports(tree):
    """[module, name or None] of each import of a syntax tree."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [[alias.name, None] for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [[node.module, alias.name] for alias in node.names]
    return found


_kept = Readings(said_in, sorted(SAID))


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
    text = path.read_text("utf-8")
    found = {
        _file(module, sources) if name is None else _source(module, name, sources)
        for module, name in _kept(text)["imports"]
    }
    patterns = [p for word, them in FINDS_BY_ITSELF.items() if word in text for p in them]
    if path.name != OWN:
        found |= {file for pattern in patterns for file in path.parent.glob(pattern)}
    return frozenset(found - {None})


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
        here: _source(module, name, sources)
        for module, name, here in _kept(package.read_text("utf-8"))["passed_on"]
        if _file(module, sources)
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
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return text
    of_other_codes = "\n".join(_kept(text)["of_other_codes"])
    return f"{kept_code(text)}\n{of_other_codes}"
