"""Laws declare themselves: tables, schema, dispatch, documentation and exports are made of what
their files say."""

import inspect
import os
import re
import shutil
from pathlib import Path

import pytest

from dem.contact.catalogue import CODES, LAWS, SLOTS, every_law, table
from dem.contact.law import ROLES
from dem.contact.registry import BASE, DEFAULTS, Laws, PairProperties
from dem.spec import LawParameters, LawsSpec
from facts import ROOT, tells
from started import python

SRC = ROOT / "src"


def ids(law):
    return f"{law.slot}-{law.name}"


@pytest.mark.parametrize("law", list(every_law()), ids=ids)
def test_what_a_law_declares_is_whole(law):
    assert set(law.kernels) <= set(ROLES)
    assert law.equation
    assert set(law.only_with) | set(law.not_with) <= set(SLOTS)
    for other, names in (law.only_with | law.not_with).items():
        assert set(names) <= set(LAWS[other])
    known = LawParameters.model_fields
    for p in law.parameters:
        assert p.key in known
        assert (f"wall_{p.key}" in known) == p.wall


def test_every_slot_has_one_default_and_the_schema_takes_it():
    for slot, laws in LAWS.items():
        assert [x.name for x in laws.values() if x.default] == [DEFAULTS[slot]]
        assert CODES[slot][DEFAULTS[slot]] == 0
    assert LawsSpec().model_dump() == DEFAULTS
    assert tuple(Laws().codes()) == (0,) * len(SLOTS)


@pytest.mark.parametrize(
    ("named", "rolling", "torsion"),
    [
        ({}, "elastic_plastic", "marshall"),
        ({"cohesion": "jkr"}, "elastic_plastic", "marshall"),
        ({"rolling": "constant_torque"}, "constant_torque", "none"),
        ({"rolling": "none"}, "none", "none"),
        ({"rolling": "constant_torque", "torsion": "marshall"}, "constant_torque", "marshall"),
        ({"normal": "linear", "damping": "linear", "tangential": "linear"}, "elastic_plastic",
         "none"),
    ],
)  # fmt: skip
def test_laws_that_are_not_named_keep_angular_momentum_and_named_ones_stay(named, rolling, torsion):
    for laws in (Laws(**named), LawsSpec.model_validate(named)):
        assert (laws.rolling, laws.torsion) == (rolling, torsion)
        assert all(getattr(laws, slot) == name for slot, name in named.items())
    Laws(**named).codes()


def test_theory_has_the_table_of_the_laws():
    text = (ROOT / "docs" / "theory.md").read_text()
    shown = re.search(r"<!-- laws: begin -->\n(.*?)\n<!-- laws: end -->", text, re.S)[1]
    assert shown == table()


# --- the page on how to add one -------------------------------------------------------------------


LAW = Path("src/dem/contact/friction/rate_free.py")
"""The law that docs/extend.md adds."""


@pytest.fixture
def with_the_law(tmp_path):
    """Runs code in a copy of the engine to which the page's law was added."""
    shutil.copytree(SRC / "dem", tmp_path / "src" / "dem")
    assert not (ROOT / LAW).exists()
    shutil.copyfile(ROOT / "examples/extend/law" / LAW, tmp_path / LAW)

    def run(code):
        own = {"PYTHONPATH": str(tmp_path / "src"), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        return python(tmp_path, "-c", code, env=os.environ | own).stdout

    return run


SPEC = (
    'from dem.spec import parse_spec; spec = parse_spec({"experiment": "drop", '
    '"laws": {"friction": "rate_free"}, "law_parameters": {"friction_floor_N": 0.001}, '
    '"geometry": {"drop_height_mm": 2, "drops": 1}})\n'
)


EXPORTED = """
from calibration.engines import lammps, liggghts
from calibration.engines.conversion import Conversion, Granulate, left_out

for code in (lammps, liggghts):
    told = left_out(spec, code.CODE)
    print(code.CODE, code.block(Granulate(spec), Conversion(spec), told), sep="\\n")
"""


def test_a_law_added_as_the_page_says_is_exported(with_the_law):
    """To the code that its file names, in that code's words; the others are told that it lacks."""
    lammps, liggghts = with_the_law(SPEC + EXPORTED).split("liggghts\n", 1)
    behind = re.search(r"tangential mindlin_rescale/force \S+ \S+ (.*)", lammps)[1]
    assert behind.split()[::2][:2] == ["floor", "rolling"]
    assert behind.split()[3] == "sds"
    assert "NOT CONVERTED" not in lammps.replace("NOT CONVERTED: rolling", "")
    assert "coefficientFriction" in liggghts
    assert tells(liggghts, "NOT CONVERTED", "friction rate_free")


# --- constants ------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", every_law(), ids=ids)
def test_a_law_declares_the_constants_that_its_kernels_read_and_gives_no_others(law):
    module = inspect.getmodule(law.kernels[next(iter(law.kernels))].py_func) if law.kernels else law
    read = set(re.findall(r"\bp\.(\w+)", inspect.getsource(module))) if law.kernels else set()
    assert set(law.constants) <= read
    assert read - set(BASE) <= set(law.constants)


def test_every_constant_of_a_pair_is_read_by_some_law():
    declared = {c for law in every_law() for c in law.constants}
    assert set(PairProperties._fields) == {*BASE, *declared}
    assert all(law.slot == slot for slot, laws in LAWS.items() for law in laws.values())
