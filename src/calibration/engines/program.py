"""Running another engine's program, and reading what it leaves."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calibration.engines import Engine, EngineError, Settings

if TYPE_CHECKING:
    from dem.spec import RunSpec


LAST_WORDS = 800
"""Characters of a failed program's output that its error quotes."""


def find(name: str, install: str) -> str:
    """Path of a program, beside this Python or on the PATH. Raises EngineError that says how to
    `install` it."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name)
    if not found:
        raise EngineError(f"the program {name} is not installed; {install}")
    return found


def stated_version(
    command: Sequence[str], pattern: str, environment: Mapping[str, str] | None = None
) -> str:
    """What an installed program says of its version: the first group of `pattern` in the output of
    `command`. Raises EngineError."""
    said = subprocess.run(
        command, input="", capture_output=True, text=True, timeout=60, env=environment, check=False
    )
    words = said.stdout + said.stderr
    found = re.search(pattern, words)
    if not found:
        raise EngineError(f"{' '.join(command)} does not state its version: {words.strip()[-200:]}")
    return found.group(1).strip()


def engine_of(
    name: str,
    experiments: tuple[str, ...],
    version: Callable[[], str],
    refuse: Callable[[RunSpec], None],
    deck: Callable[[RunSpec, Path], None],
    start: Callable[[RunSpec, Path, float], tuple[dict, dict]],
) -> Engine:
    """`Engine` of an installed program that is named by its version(), and given a deck.

    deck(spec, folder) writes it; start(spec, folder, timeout_s) starts the program on it and gives
    metrics and last state."""

    def identity(settings):
        return {"version": version()}

    def simulate(spec, folder, entry):
        deck(spec, folder)
        return start(spec, folder, entry["settings"]["timeout_s"])

    return Engine(name, Settings, experiments, identity, refuse, simulate)


def run(
    command: Sequence[str],
    folder: str | Path,
    timeout_s: float,
    environment: Mapping[str, str] | None = None,
) -> str:
    """Output of a command run in `folder`, kept in output.txt. Raises EngineError when it fails
    or takes too long."""
    output = Path(folder) / "output.txt"
    with open(output, "w") as stream:
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                timeout=timeout_s,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise EngineError(f"{_name(command)} was stopped after {timeout_s:g} s") from None
        except OSError as error:
            raise EngineError(f"{_name(command)} cannot be started: {error.strerror}") from None
    text = output.read_text(errors="replace")
    if done.returncode:
        words = text[-LAST_WORDS:].strip() or "no output"
        raise EngineError(f"{_name(command)} ended with status {done.returncode}: {words}")
    return text


def _name(command):
    return Path(command[0]).name if isinstance(command, list) else command


def read_frames(path: str | Path) -> list[dict[str, np.ndarray]]:
    """[{column: (n,) array}] of all frames of a LIGGGHTS or LAMMPS text dump, sorted by id.
    Raises EngineError."""
    try:
        parts = Path(path).read_text().split("ITEM: ATOMS")[1:]
        return [_frame(part.split("ITEM:")[0].splitlines()) for part in parts]
    except (OSError, ValueError, IndexError) as error:
        raise EngineError(f"{Path(path).name} cannot be read: {error}") from None


def _frame(lines):
    names = lines[0].split()
    rows = np.array([line.split() for line in lines[1:]], float).reshape(-1, len(names))
    if not np.isfinite(rows).all():
        raise ValueError("it holds numbers that are not finite")
    rows = rows[np.argsort(rows[:, names.index("id")])]
    return dict(zip(names, rows.T, strict=True))


def read_dump(path: str | Path) -> dict[str, np.ndarray]:
    """{column: (n,) array} of the last frame of a dump. Raises EngineError."""
    frames = read_frames(path)
    if not frames:
        raise EngineError(f"{Path(path).name} holds no frame")
    return frames[-1]


def time_of(path: str | Path, time_step: float) -> float:
    """Time [s] of the last frame of a dump. Raises EngineError."""
    try:
        return time_step * int(Path(path).read_text().split("ITEM: TIMESTEP")[-1].split()[0])
    except (OSError, ValueError, IndexError) as error:
        raise EngineError(f"{Path(path).name} cannot be read: {error}") from None


def state_of(dump: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays of the grains at the end, from a dump with x, v, omega, radius and id. position,
    velocity and spin (n, 3), radius (n,), tag and grain (n,), in SI units."""
    at = {
        key: np.column_stack([dump[name + axis] for axis in "xyz"])
        for key, name in (("position", ""), ("velocity", "v"), ("spin", "omega"))
    }
    tag = dump["id"].astype(np.int64)
    return at | {"radius": dump["radius"], "tag": tag, "grain": tag}


def prime_seed(seed: int) -> int:
    """A prime above 10,000 for each `seed` from 0: what LIGGGHTS takes as a seed."""
    n = 10_007 + 7_919 * seed
    while any(n % k == 0 for k in range(2, math.isqrt(n) + 1)):
        n += 1
    return n
