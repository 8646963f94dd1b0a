"""What a run's numbers depend on beside its spec: a hash of the engine's code, and the software
that compiles it."""

import ast
import hashlib
import os
import platform
import sys
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import cache_from_source
from pathlib import Path

from dem.io.files import replace_file

ROOT = Path(__file__).parent
OUTSIDE = {
    "cli.py",
    "template.py",
    "advice.py",
    "fingerprint.py",
    "kernel_cache.py",
    "export.py",
    "benchmark",
    "render",
    "tables",  # what a spec takes from a table stands in it as numbers
}  # no run's result depends on these
UNCOMPILED = {
    "experiments",
    "measure",
    "io",
    "spec.py",
    "run.py",
    "results.py",
    "sizes.py",
    "schema.py",
    "units.py",
    "errors.py",
}
"""Sources of the engine that hold no kernel and that none imports."""

COMPILERS = ("numba", "llvmlite", "numpy")
TARGET = (
    "NUMBA_CPU_NAME",
    "NUMBA_CPU_FEATURES",
)  # what a user may compile for in place of the host
SAID = {"equation", "source", "exports", "left_out", "dispensable"}
"""What a `Law` says for the documentation and for other codes: no run's result depends on it."""
_WITHOUT_MEANING = {"ctx", "kind", "type_comment", "type_ignores"}
TYPES = {"__future__", "typing", "collections.abc", "numpy.typing"}
"""Modules that are imported for types: what a name from them does stands where it is used."""

EQUAL = {"afcb44f1c983dd77": "a9f0951b26b78d95", "cfe2b18ed21fdc11": "b5ae1de6594b0dea"}
"""Digest of the code as it is, and of its kernel -> those of an earlier engine, where the runs of
both are equal to the bit: a change of form alone makes no run again."""

TYPED = {("arg", "annotation"), ("FunctionDef", "returns"), ("AsyncFunctionDef", "returns")}
"""Where types stand that decide nothing; those of a class's fields do, as pydantic reads them."""


def engine_sources() -> list[Path]:
    """Paths of the sources that a run's result depends on, in order."""
    return [p for p in sorted(ROOT.rglob("*.py")) if not OUTSIDE & set(p.relative_to(ROOT).parts)]


@cache
def engine_fingerprint() -> str:
    """First 16 hex digits of the SHA-256 over the syntax trees of `engine_sources`: comments,
    docstrings, types of arguments and returns, the layout of the code and what a law says (SAID) do
    not count. That of the earlier engine where the code is EQUAL to one."""
    digest = _digest(engine_sources())
    return EQUAL.get(digest, digest)


@cache
def kernel_fingerprint() -> str:
    """The same over what is compiled, or seen by what is compiled: another experiment compiles
    nothing anew."""
    return _digest(p for p in engine_sources() if not UNCOMPILED & set(p.relative_to(ROOT).parts))


def _digest(paths):
    """Digest of the code of these sources, kept beside the compiled Python of this module by their
    bytes: to parse them all takes a second, and every start asks."""
    sources = {path.relative_to(ROOT).as_posix(): path.read_bytes() for path in paths}
    own = repr((sys.version, Path(__file__).read_bytes(), sources)).encode()
    compiled = Path(cache_from_source(__file__))
    kept = compiled.with_suffix(f".{hashlib.sha256(own).hexdigest()[:16]}.txt")
    with suppress(OSError):
        return kept.read_text("ascii")
    digest = hashlib.sha256()
    for name, source in sources.items():
        digest.update(name.encode())
        digest.update(code_of(source).encode())
    found = digest.hexdigest()[:16]
    if not sys.dont_write_bytecode:
        with suppress(OSError):  # a folder that cannot be written to keeps nothing
            replace_file(kept, lambda file: file.write(found.encode()))
    return found


def code_of(source: str | bytes) -> str:
    """Text of a module's syntax tree, without docstrings, positions, and types of arguments and
    returns with their imports; alike in all versions of Python that read the code alike."""
    return _text(ast.parse(source))


def _text(node):
    if isinstance(node, list):
        return f"[{','.join(_text(part) for part in node if not _for_types(part))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = []
    for name in node._fields:
        value = getattr(node, name, None)
        if name == "body" and _has_docstring(node):
            value = value[1:]
        if name == "keywords" and getattr(getattr(node, "func", None), "id", "") == "Law":
            value = [keyword for keyword in value if keyword.arg not in SAID]
        # fields that a newer Python adds are empty in older code
        empty = value is None and not isinstance(node, ast.Constant)
        if (type(node).__name__, name) in TYPED:
            continue
        if name not in _WITHOUT_MEANING and not empty and value != []:
            fields.append(f"{name}={_text(value)}")
    return f"{type(node).__name__}({','.join(fields)})"


def _for_types(node):
    """Return whether a statement is an import for types."""
    if isinstance(node, ast.If):
        return getattr(node.test, "id", "") == "TYPE_CHECKING"
    return isinstance(node, ast.ImportFrom) and node.module in TYPES


def _has_docstring(node):
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    return isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None


@cache
def software() -> dict[str, str]:
    """{name: version} of what compiles the engine and computes with it: numba, llvmlite, numpy and
    Python."""
    found = {}
    for name in COMPILERS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # a copy without metadata
            found[name] = "unknown"
    return found | {"python": platform.python_version()}


def stack_digest() -> str:
    """First 12 hex digits of a hash of `software` and of the processor that numba is told to
    compile for."""
    parts = sorted(software().items())
    parts += [(name, os.environ.get(name, "")) for name in TARGET] + [("", platform.machine())]
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:12]


@cache
def cpu_target() -> str:
    """Name of the processor that numba compiles for: the host's unless NUMBA_CPU_NAME gives
    another."""
    from llvmlite.binding import get_host_cpu_name  # loads LLVM, which only who runs needs

    return os.environ.get("NUMBA_CPU_NAME") or get_host_cpu_name()
