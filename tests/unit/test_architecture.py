"""The page of the architecture names what there is, and the packages are the ones it says."""

import ast
import importlib.util
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST = 14  # names at the top of the calibration


def generator():
    """docs/every_name.py, which no package holds."""
    spec = importlib.util.spec_from_file_location("every_name", ROOT / "docs" / "every_name.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


EVERY = generator()
PAGE = EVERY.PAGE.read_text("utf-8")


@pytest.mark.parametrize("package", EVERY.PACKAGES)
def test_the_page_names_every_name_at_the_top_of_a_package(package):
    """`python docs/every_name.py` writes the tables."""
    part = PAGE.split(f"### `src/{package}`\n")[1].split("\n### ")[0]
    there = {f"{p.name}/" if p.is_dir() else p.name for p in EVERY.names(package)}
    shown = {line.split("`")[1] for line in part.splitlines() if line.startswith("| `")}
    assert shown == there


def test_every_name_says_what_is_in_it():
    silent = [p for package in EVERY.PACKAGES for p in EVERY.names(package)]
    assert not [str(p) for p in silent if not EVERY.sentence(p)]


def test_the_calibration_has_few_names_and_the_contract_knows_them_all():
    top = {p.stem for p in EVERY.names("calibration")}
    assert len(top) + 1 <= MOST  # and the workflow
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    [layers] = [c["layers"] for c in contracts if c.get("containers") == ["calibration"]]
    assert {name for layer in layers for name in layer.split(" | ")} == top
    assert set(EVERY.CALIBRATION) == {p.name for p in EVERY.names("calibration") if p.is_dir()}


COMPILED = {"law", "_leaf", "njit", "inlined", "intrinsic", "overload"}
"""Decorators of what numba compiles, for floats and lanes alike: such functions have no types."""


def is_compiled(function):
    """Whether numba compiles a function or takes it as its own."""
    words = {re.split(r"[.(]", ast.unparse(d))[0] for d in function.decorator_list}
    return bool(COMPILED & words)


def public_functions(path):
    """Public functions and methods of a module that Python calls, as syntax."""
    tree = ast.parse(path.read_text("utf-8"))
    holders = [tree, *(n for n in tree.body if isinstance(n, ast.ClassDef))]
    for node in (n for holder in holders for n in holder.body):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            if not is_compiled(node):
                yield node


def checked_files():
    """The modules that the type checker looks at, by pyproject.toml."""
    mypy = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mypy"]
    found, left_out = [ROOT / place for place in mypy["files"]], mypy["exclude"]
    every = sorted(p for f in found for p in (f.rglob("*.py") if f.is_dir() else [f]))
    return [p for p in every if not any(place in p.as_posix() for place in left_out)]


@pytest.mark.parametrize("path", checked_files(), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_public_functions_of_a_checked_package_have_types(path):
    for function in public_functions(path):
        arguments = [*function.args.args, *function.args.kwonlyargs]
        untyped = [
            a.arg for a in arguments if a.annotation is None and a.arg not in ("self", "cls")
        ]
        assert not untyped, function.name
        assert function.returns is not None, function.name
