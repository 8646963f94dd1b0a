"""A law declares the constants that it reads, and each constant of a pair is read by some law."""

import inspect
import re

import pytest

from dem.contact.catalogue import LAWS, every_law
from dem.contact.properties import BASE, PairProperties


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
