"""Compiled code is never that of another engine, and importing the engine asks nothing of the
machine."""

import os
import re
import shutil
from pathlib import Path

import pytest

from dem import fingerprint, kernel_cache
from facts import ROOT
from started import python


def folder_of(source, tmp_path, **environment):
    """Where an engine at `source` would keep its compiled code."""
    env = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "PYTHON"))}
    env |= {"PYTHONPATH": str(source), "NUMBA_CACHE_DIR": str(tmp_path / "cache")} | environment
    code = "import dem, os; print(dem.__file__); print(os.environ['NUMBA_CACHE_DIR'])"
    file, folder = python(None, "-c", code, env=env).stdout.splitlines()
    assert Path(file).is_relative_to(source)
    return Path(folder)


@pytest.fixture
def copy(tmp_path):
    """The engine's sources, to be changed."""
    return Path(shutil.copytree(ROOT / "src" / "dem", tmp_path / "src" / "dem")).parent


def test_below_the_users_folder_each_engine_has_its_own(copy, tmp_path):
    before = folder_of(copy, tmp_path)
    assert before.parent == tmp_path / "cache"
    assert list((copy / "dem").glob("__pycache__/fingerprint.*.txt")), "kept for the next start"
    law = copy / "dem" / "contact" / "friction" / "constant.py"
    law.write_text("# a remark\n\n" + law.read_text())
    assert folder_of(copy, tmp_path) == before
    said = law.read_text().replace('words="', 'words="other ').replace("Coulomb", "Amontons")
    assert said != law.read_text()
    law.write_text(said)
    assert folder_of(copy, tmp_path) == before, "what a law says is no part of the engine"
    law.write_text(law.read_text() + "\nANOTHER = 1\n")
    assert folder_of(copy, tmp_path) not in (before, before.parent)


def test_what_is_not_compiled_holds_no_kernel_and_no_kernel_sees_it():
    engine = ROOT / "src" / "dem"
    for path in fingerprint.engine_sources():
        own = fingerprint.UNCOMPILED & set(path.relative_to(engine).parts)
        text = path.read_text()
        if own:
            assert not re.search(r"njit|from numba|import numba|dem\.lanes", text), path
        elif re.search(r"njit|dem\.lanes", text):
            for name in fingerprint.UNCOMPILED - {"errors.py"}:
                assert f"dem.{name.removesuffix('.py')}" not in text, path


@pytest.mark.parametrize("name", ["numba", "llvmlite", "numpy", "python"])
def test_other_software_has_a_folder_of_its_own(name, monkeypatch):
    before = fingerprint.stack_digest()
    other = fingerprint.software() | {name: "0.0.1"}
    monkeypatch.setattr(fingerprint, "software", lambda: other)
    assert fingerprint.stack_digest() != before


def test_a_process_started_by_another_uses_the_same_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = kernel_cache.kernel_cache()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(first))
    assert kernel_cache.kernel_cache() == first
    # the folder of another engine is no parent for this one's
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / f"engine-{'0' * 16}-{'0' * 12}"))
    assert kernel_cache.kernel_cache() == first


def no_home():
    raise RuntimeError("Could not determine home directory.")


def test_a_folder_that_others_may_write_to_is_not_used(monkeypatch, tmp_path):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    planted = tmp_path / f"granular-calibration-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    assert not kernel_cache.kernel_cache().is_relative_to(planted)


NOBODY = """
import os, pwd
def unknown(number):
    raise KeyError(f"getpwuid(): uid not found: {number}")
pwd.getpwuid = unknown
import dem.simulation
print(os.environ["NUMBA_CACHE_DIR"])
"""


def test_the_engine_loads_for_a_user_whom_nobody_knows(tmp_path):
    drop = ("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    env = {k: v for k, v in os.environ.items() if k not in drop} | {"TMPDIR": str(tmp_path)}
    done = python(None, "-c", NOBODY, env=env)
    found = Path(done.stdout.strip())
    assert found.is_relative_to(tmp_path)
    assert found.parent.stat().st_mode & 0o077 == 0  # private


SAME = '''
"""A module."""
import math
def area(r):
    """Of a circle."""
    # the comment
    return (math.pi
            * r**2)
'''
OTHER = '"""Another text."""\nimport math\ndef area(r): return math.pi*r ** 2\n'


def test_comments_docstrings_and_layout_are_no_change_of_the_code():
    assert fingerprint.code_of(SAME) == fingerprint.code_of(OTHER)


TYPED = """
from __future__ import annotations
import math
from collections.abc import Callable
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from numpy.typing import NDArray
def area(r: float) -> Callable[[float], NDArray]: return math.pi*r ** 2
"""


def test_types_of_arguments_and_returns_are_no_change_of_the_code():
    assert fingerprint.code_of(TYPED) == fingerprint.code_of(SAME)


@pytest.mark.parametrize(
    "change",
    [("r**2", "r**3"), ("math.pi", "math.e"), ("(r)", "(r, s=1)"), ("def area", "def areas")],
)
def test_any_change_of_the_code_shows(change):
    assert fingerprint.code_of(SAME) != fingerprint.code_of(SAME.replace(*change))


def test_an_engine_that_is_equal_to_an_earlier_one_is_the_code_as_it_is():
    """A line of an older code says nothing of this one, and goes."""
    whole = fingerprint._digest(fingerprint.engine_sources())
    assert set(fingerprint.EQUAL) <= {whole, fingerprint.kernel_fingerprint()}


KERNEL = """\
import dem
from numba import njit

@njit(cache=True)
def twice(x):
    return 2.0 * x

print(twice(21.0))
"""


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A script with a kernel, and the folder in which numba keeps what it compiled of it."""
    folder = tmp_path_factory.mktemp("compiled")
    (folder / "twice.py").write_text(KERNEL)

    def start():
        env = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
        cache = {"NUMBA_CACHE_DIR": str(folder / "cache")}
        return python(None, folder / "twice.py", status=None, env=env | cache)

    assert start().stdout == "42.0\n"
    return start, folder / "cache"


def kept_code(cache):
    """{suffix: the file} of the one kernel."""
    return {path.suffix: path for path in cache.rglob("*.nb[ic]")}


@pytest.mark.parametrize(("suffix", "left"), [(".nbi", "half"), (".nbc", "zeros")])
def test_compiled_code_that_is_cut_off_is_made_again(compiled, suffix, left):
    """As a power cut leaves it: an empty file, one that ends early, or one whose end was never
    written."""
    start, cache = compiled
    path = kept_code(cache)[suffix]
    good = path.read_bytes()
    half = len(good) // 2
    bad = {"nothing": b"", "half": good[:half], "zeros": good[:half] + bytes(len(good) - half)}
    path.write_bytes(bad[left])
    done = start()
    assert (done.stdout, done.stderr) == ("42.0\n", "")
    assert kernel_cache.whole(kept_code(cache)[suffix])
