"""What a rule's result depends on beside its files: the code and the sections of the configuration
that it reads.

The code is found from the imports, beginning with the module of the rule's function and that of
the study. Comments, docstrings and layout do not count. Runs are not among these rules: their spec
and the engine name them.
"""

import ast
import hashlib
import json
import os
from contextlib import suppress
from functools import cache
from pathlib import Path

from calibration.files import read_json, write_text
from dem.fingerprint import SAID, code_of
from dem.io.checked import digest_of, is_sealed, sealed
from dem.io.files import write_json

SOURCES = Path(__file__).parents[1]
PACKAGES = ("calibration", "dem", "diagnosis", "paper")
"""The project's own: where a wheel is installed, all other packages lie beside them."""
HANDED = "calibration.chain.study"
OF_A_PLAN = ("design.csv", "plan.json")
DOCUMENTED = {"equation", "source"}  # of a law: read by the documentation alone
FINDS_BY_ITSELF = {
    "iter_modules": ("*.py", "*/__init__.py"),
    '.glob("*.py")': ("**/*.py",),
}
"""What stands in a module that finds the modules beside it, and which these are."""
OWN = Path(__file__).name  # where these words stand and nothing is found


def task_digest(task, config, sources=SOURCES):
    """The `digest` of a declared task: of its function and of the study that this is handed."""
    return digest(config, task.reads, [task.function.split(":")[0], HANDED], sources)


def digest(config, sections, names, sources=SOURCES):
    """First 12 hex digits of a hash of sections of a `Config` and of the code that importing the
    modules `names` brings in; sources: the folder of the packages."""
    values = config.model_dump(mode="json", include=set(sections))
    files = {path for name in names for path in modules(name, Path(sources))}
    return _hash([json.dumps(values, sort_keys=True)], files)


def code_digest(name, packages, sources=SOURCES):
    """First 12 hex digits of a hash of the code of `packages` that importing a module brings in."""
    roots = [sources.joinpath(*package.split(".")) for package in packages]
    files = {p for p in modules(name, sources) if any(root in p.parents for root in roots)}
    return _hash([], files)


def _hash(parts, files):
    parts += [_content(path, path.stat().st_mtime_ns) for path in sorted(files)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


def digest_with(code, files):
    """A `digest` and what files hold; one that is missing counts as such."""
    parts = [code, *(digest_of(f) if Path(f).is_file() else "" for f in files)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


def stamp(path, content, new=True):
    """Let the first line of the file at `path` be `content`, and leave the file as it is where it
    is so, so that its time is that of the last change. new: make one where there is none. A folder
    that can only be read stays as it is."""
    path = Path(path)
    try:
        if path.read_text().partition("\n")[0] == content:
            return
    except FileNotFoundError:
        if not new:
            return
    except OSError:
        return
    with suppress(OSError):
        write_text(content, path)


def reopen(path, reason):
    """Let the stamp at `path` change, so that what is made from it is made again."""
    write_text(f"{Path(path).read_text()}\n{reason}", path)


def record(path, outputs, folder):
    """Write beside the stamp at `path` what was made from it: checksums of the files among
    `outputs`, by their paths in the study's folder. A plan has its own."""
    kept = Path(f"{path}.json")
    found = _recorded(kept)
    for file in map(Path, outputs):
        if file.is_file() and file.name not in OF_A_PLAN:
            found[os.path.relpath(file, folder)] = digest_of(file)
    write_json(kept, sealed(found))


def altered(folder):
    """(stamp, file) of each file of a study that is not as a rule left it."""
    for kept in sorted(Path(folder).glob(".made_from/*.json")):
        for name, made in _recorded(kept).items():
            file = Path(folder, name)
            if file.is_file() and digest_of(file) != made:
                yield kept.with_suffix(""), file


def _recorded(kept):
    """Content of a record; nothing is known where there is none, or a damaged one."""
    try:
        found = read_json(kept)
    except (OSError, ValueError):
        return {}
    return {k: v for k, v in found.items() if k != "checksum"} if is_sealed(found) else {}


@cache
def modules(name, sources=SOURCES):
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
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {_file(alias.name, sources) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {_source(node.module, alias.name, sources) for alias in node.names}
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
    """Templates and schemas that belong to the package of a module."""
    return [p for p in path.parent.iterdir() if p.suffix in (".j2", ".json")]


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
