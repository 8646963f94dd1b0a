"""What another engine's program may do wrong, by a program that stands in for it: a sentence."""

import os
import sys
import textwrap
import time
from pathlib import Path

import pytest

from calibration import engines
from calibration.engines import lammps, liggghts, program
from calibration.errors import ConfigError
from facts import refused
from small_heap import SPEC

CODES = {
    "liggghts": ("liggghts", "Version LIGGGHTS 3.8.0", liggghts),
    "lammps": ("lmp", "Large-scale Simulator - 2 Aug 2023", lammps),
}
"""Code: (its program, what it says of its version, its module)."""
COLUMNS = "id x y z vx vy vz omegax omegay omegaz radius"
GRAIN = "{} 0 0 0.01 0 0 0 0 0 0 0.003"


def dump(grains, stated=None, columns=COLUMNS):
    """Text of a frame with these rows, which states another number if given."""
    count = len(grains) if stated is None else stated
    head = f"ITEM: TIMESTEP\n9\nITEM: NUMBER OF ATOMS\n{count}\nITEM: ATOMS {columns}\n"
    return head + "".join(f"{row}\n" for row in grains)


@pytest.fixture(params=CODES)
def code(request, tmp_path, monkeypatch):
    """Name of a code, whose program is looked for in this test's folder first."""
    module = CODES[request.param][2]
    monkeypatch.setenv("PATH", str(tmp_path / "bin"), prepend=os.pathsep)
    monkeypatch.setattr(program.sys, "executable", str(tmp_path / "none" / "python"))
    module.version.cache_clear()
    (tmp_path / "bin").mkdir()
    yield request.param
    module.version.cache_clear()


PYTHON = sys.executable


def stand_in(code, tmp_path, text, version=None):
    """A program that says its version and does what `text` says when it gets a deck."""
    name, said, module = CODES[code]
    path = tmp_path / "bin" / name
    body = textwrap.indent(textwrap.dedent(text), "    ")
    said = said if version is None else version
    path.write_text(
        f"#!{PYTHON}\nimport os, sys, time\nfrom pathlib import Path\n"
        f"if '-in' in sys.argv:\n{body}\nelse:\n    print({said!r})\n"
    )
    path.chmod(0o755)
    module.version.cache_clear()


def made(code, tmp_path, timeout_s=60.0, seed=1):
    """Make a heap with the program that stands in."""
    entry = engines.entry_of({"name": code, "timeout_s": timeout_s})
    spec = SPEC | {"seed": seed, "engine": entry}
    return engines.make(spec, tmp_path / f"run{seed}")


def left(content):
    return f"Path('end.dump').write_text({content!r})"


ROWS = [GRAIN.format(n) for n in range(1, 5)]
FAULTS = {
    "no dump": ("pass", ["end.dump"]),
    "a status of its own": ("print('ERROR: no licence'); sys.exit(7)", ["status 7", "no licence"]),
    "not a number": (left(dump([*ROWS[:3], GRAIN.format(4).replace("0.01", "nan")])), ["finite"]),
    "a dump cut off between rows": (left(dump(ROWS[:2], stated=4)), ["end.dump", "2 of 4"]),
    "a dump cut off in a row": (left(dump(ROWS)[:-9]), ["end.dump"]),
    "a dump without speeds": (
        left(dump(["1 0 0 0 0.003"], columns="id x y z radius")),
        ["vx", "omegaz"],
    ),
    "no grains": (left(dump([])), []),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_program_s_fault_is_a_sentence_and_leaves_no_result(code, fault, tmp_path):
    text, named = FAULTS[fault]
    stand_in(code, tmp_path, text)
    with refused(engines.DemError, *named) as caught:
        made(code, tmp_path)
    assert len(str(caught.value).splitlines()) <= 3
    assert not (tmp_path / "run1" / "result.json").exists()


def test_a_program_that_hangs_is_ended_with_what_it_started(code, tmp_path):
    """As mpirun does, it starts another one, which does not outlive it."""
    child = f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); "
    child += "time.sleep(600)"
    text = f"import subprocess\nsubprocess.run([{PYTHON!r}, '-c', {child!r}])"
    stand_in(code, tmp_path, text)
    with refused(engines.EngineError, "3 s"):
        made(code, tmp_path, timeout_s=3.0)
    pid = int((tmp_path / "pid").read_text())
    for _ in range(100):
        if not _lives(pid):
            return
        time.sleep(0.1)
    raise AssertionError(f"process {pid} lives on")


def _lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(") ")[1][0] != "Z"
    except FileNotFoundError:
        return False


def test_a_missing_program_is_said_with_how_to_install_it(code, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with refused(ConfigError, "not installed", key="engine", value=code):
        engines.entry_of(code)


def test_a_program_of_an_unknown_version_is_refused(code, tmp_path):
    stand_in(code, tmp_path, "pass", version="some other program 1.0")
    with refused(ConfigError, "version", key="engine", value=code):
        engines.entry_of(code)


def test_a_file_that_is_no_program_is_refused(code, tmp_path):
    path = tmp_path / "bin" / CODES[code][0]
    path.write_bytes(b"\x7fELF nonsense")
    path.chmod(0o755)
    with refused(ConfigError, key="engine", value=code):
        engines.entry_of(code)


def test_a_run_that_was_planned_with_another_version_is_not_made(code, tmp_path):
    stand_in(code, tmp_path, "pass")
    entry = engines.entry_of(code)
    older = CODES[code][1].replace("3.8.0", "3.5.0").replace("2023", "2019")
    stand_in(code, tmp_path, "pass", version=older)
    with refused(engines.EngineError, "plan"):
        engines.make(SPEC | {"engine": entry}, tmp_path / "run")
