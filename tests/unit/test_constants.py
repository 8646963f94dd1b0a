"""Constants stand once, π is written as such, and a law declares the constants that it reads."""

import inspect
import re
from pathlib import Path

import pytest

from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS, every_law
from dem.contact.properties import BASE, PairProperties

ROOT = Path(__file__).parents[2]
SOURCES = [p for d in ("src", "workflow") for p in sorted((ROOT / d).rglob("*")) if p.is_file()]
# multiples of π that a formula may hold, to eight digits
PI = [f"{k * 3.141592653589793:.8f}" for k in (0.5, 1, 4 / 3, 1.5, 2, 3, 4, 6, 8)]


def texts():
    for path in SOURCES:
        if path.suffix in (".py", ".smk", ".j2", ".in", ".R") or path.name == "Snakefile":
            yield path.relative_to(ROOT).as_posix(), path.read_text("utf-8")


def test_gravity_stands_once():
    found = [p for p, text in texts() for _ in re.finditer(r"\b9\.8(0665|1)?\b", text)]
    assert found == ["src/dem/constants.py"]
    assert GRAVITY == 9.81


def test_pi_is_not_written_by_digits():
    digits = re.compile("|".join(re.escape(p[:8]) for p in PI))
    assert [(p, m[0]) for p, text in texts() for m in digits.finditer(text)] == []


@pytest.mark.parametrize("law", every_law(), ids=lambda law: f"{law.slot}-{law.name}")
def test_a_law_declares_the_constants_that_its_kernels_read_and_gives_no_others(law):
    module = inspect.getmodule(law.kernels[next(iter(law.kernels))].py_func) if law.kernels else law
    read = set(re.findall(r"\bp\.(\w+)", inspect.getsource(module))) if law.kernels else set()
    assert set(law.constants) <= read
    assert read - set(BASE) <= set(law.constants)


def test_every_constant_of_a_pair_is_read_by_some_law():
    declared = {c for law in every_law() for c in law.constants}
    assert set(PairProperties._fields) == {*BASE, *declared}
    assert all(law.slot == slot for slot, laws in LAWS.items() for law in laws.values())
