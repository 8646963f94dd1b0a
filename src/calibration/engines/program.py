"""Running another engine's program, and reading what it leaves."""

import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psutil

from calibration.engines import Engine, EngineError, Settings
from dem.spec import RunSpec

LAST_WORDS = 800
"""Characters of a failed program's output that its error quotes."""
ASKED_S = 60.0
"""A program that is asked for its version and says nothing for so long hangs [s]."""


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
    """Return what an installed program says of its version: the first group of `pattern` in the
    output of `command`. Raises EngineError."""
    try:
        with TemporaryDirectory() as folder:  # LIGGGHTS leaves a log file where it is started
            said = subprocess.run(
                command, input="", capture_output=True, text=True, errors="replace",
                timeout=ASKED_S, env=environment, check=False, cwd=folder,
            )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise EngineError(f"{_name(command)} did not state its version in {ASKED_S:g} s") from None
    except OSError as error:
        raise EngineError(f"{_name(command)} cannot be started: {error.strerror}") from None
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

    return Engine(name, Settings, experiments, identity, simulate, refuse)


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
            process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=environment,
            )
        except OSError as error:
            raise EngineError(f"{_name(command)} cannot be started: {error.strerror}") from None
        status = _ended(process, command, timeout_s)
    text = output.read_text(errors="replace")
    if status:
        words = text[-LAST_WORDS:].strip() or "no output"
        raise EngineError(f"{_name(command)} ended with status {status}: {words}")
    return text


def _ended(process, command, timeout_s):
    """Exit status of a process. It is ended with all that it has started (mpirun starts the
    program) after `timeout_s`, and where this one is interrupted. It stays in the group of this
    process, so that what ends the whole group ends it too."""
    try:
        return process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        raise EngineError(f"{_name(command)} was stopped after {timeout_s:g} s") from None
    finally:
        if process.returncode is None:
            for child in psutil.Process(process.pid).children(recursive=True):
                with suppress(psutil.NoSuchProcess):  # it has just ended
                    child.kill()
            process.kill()
            process.wait()


def _name(command):
    return Path(command[0]).name if isinstance(command, list) else command


def read_frames(path: str | Path) -> list[dict[str, np.ndarray]]:
    """[{column: (n,) array}] of all frames of a LIGGGHTS or LAMMPS text dump, sorted by id.
    Raises EngineError."""
    if not Path(path).is_file():
        raise EngineError(f"{Path(path).name} is missing, or no plain file")
    try:
        head, *parts = Path(path).read_text().split("ITEM: ATOMS")
        heads = [head, *(part.partition("ITEM:")[2] for part in parts)]
        bodies = [part.split("ITEM:")[0].splitlines() for part in parts]
        return [_frame(body, _stated(head)) for body, head in zip(bodies, heads, strict=False)]
    except (OSError, ValueError, IndexError) as error:
        raise EngineError(f"{Path(path).name} cannot be read: {error}") from None


def _stated(head):
    """Number of grains that a frame's head states, None where it does not."""
    found = re.search(r"NUMBER OF ATOMS\s+(\d+)", head)
    return int(found[1]) if found else None


def _frame(lines, count):
    names = lines[0].split()
    if count not in (None, len(lines) - 1):
        raise ValueError(f"it is cut off: {len(lines) - 1} of {count} grains")
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
    parts = (("position", ""), ("velocity", "v"), ("spin", "omega"))
    columns = [name + axis for _, name in parts for axis in "xyz"]
    if missing := [name for name in (*columns, "radius", "id") if name not in dump]:
        raise EngineError(f"a dump without the columns {', '.join(missing)}")
    at = {key: np.column_stack([dump[name + axis] for axis in "xyz"]) for key, name in parts}
    tag = dump["id"].astype(np.int64)
    return at | {"radius": dump["radius"], "tag": tag, "grain": tag}


SEEDS = 2**31 - 2**16
"""Numbers that seeds are spread over: what is above is the reach of the next prime. It and the step
between seeds have no divisor in common, so no two seeds below it share a number."""


def prime_seed(seed: int) -> int:
    """A prime above 10,000 for each `seed` from 0: what LIGGGHTS takes as a seed, an integer of 32
    bits."""
    n = 10_007 + 7_919 * seed % SEEDS
    while any(n % k == 0 for k in range(2, math.isqrt(n) + 1)):
        n += 1
    return n
