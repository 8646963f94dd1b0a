"""Public functions have types: each argument and what is returned."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "src"
AT_MOST = {"calibration": 0, "dem": 0, "diagnosis": 0, "paper": 0}
"""Functions of a package that may be without types, what numba compiles left out; the number may
only shrink."""
COMPILED = {"law", "_leaf", "njit", "inlined", "intrinsic", "overload"}
"""Decorators of what numba compiles, for floats and lanes alike: such functions have no types."""


def public_functions(path: Path) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """(name, syntax) of the functions of a module and of the methods of its classes whose names do
    not begin with an underscore."""
    tree = ast.parse(path.read_text("utf-8"))
    classes = [n for n in tree.body if isinstance(n, ast.ClassDef) and n.name[0] != "_"]
    for holder in (tree, *classes):
        for node in holder.body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name[0] != "_":
                yield ".".join([*([holder.name] if holder is not tree else []), node.name]), node


def is_compiled(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether numba compiles a function or takes it as its own."""
    words = {re.split(r"[.(]", ast.unparse(d))[0] for d in function.decorator_list}
    return bool(COMPILED & words)


def has_types(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether all arguments but `self` and `cls`, and what is returned, have a type."""
    given = function.args
    arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    named = [a for a in arguments if a is not None and a.arg not in ("self", "cls")]
    return function.returns is not None and all(a.annotation is not None for a in named)


@pytest.mark.parametrize("package", AT_MOST)
def test_no_more_public_functions_are_without_types(package):
    without = [
        f"{path.relative_to(SOURCES)}: {name}"
        for path in sorted((SOURCES / package).rglob("*.py"))
        if "workflow" not in path.parts
        for name, function in public_functions(path)
        if not (has_types(function) or is_compiled(function))
    ]
    assert len(without) <= AT_MOST[package], "\n".join(without)


def test_the_type_checker_runs_over_these_packages():
    project = tomllib.loads((SOURCES.parent / "pyproject.toml").read_text())
    files = [*(f"src/{package}" for package in AT_MOST), "benchmarks"]
    assert project["tool"]["mypy"]["files"] == files
