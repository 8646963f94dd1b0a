"""Decks: folders with all that another program needs to pour the calibrated heap, and one command
that holds its heaps against the calibrated ones.

A law of the same name is not the same law: LAMMPS' rolling spring is a constant, and its heaps are
flatter with the same numbers. Who wants the numbers that LAMMPS or LIGGGHTS asks for calibrates in
it (`engine`).
"""

import hashlib
import json
import math
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill
from typing import Any

import numpy as np
import scipy

from calibration import engines
from calibration.engines import EngineError, rig
from calibration.engines.conversion import Conversion, granulate, left_out
from calibration.engines.templates import macros
from calibration.files import DamagedError, read_json, write_text
from calibration.study.config import overlay
from calibration.telling.export.parameters import to_yaml
from calibration.telling.export.trials import READERS, profile, rows_of, told
from dem.errors import DemError, InputError, MeasureError
from dem.experiments.heap import Rig
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import RunSpec, load_spec, parse_spec

DECKS = ("liggghts", "lammps")
"""Codes that have decks."""
NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
"""Of YADE heaps are tried, and no deck is written."""
ONE_HEAP = 0.95
"""Share of single heaps of the calibrated model that lie within what a check allows."""
SEEDS = 8
"""Heaps of a check, in each code."""
FEWEST = 4
"""Heaps of a code with which a difference can be tested."""


def write_decks(
    spec: RunSpec,
    conversion: Conversion,
    about: Sequence[str],
    expected: Mapping[str, Any],
    folder: str | Path,
) -> None:
    """Write a deck of a calibrated `RunSpec` for each code into `folder`/<code>.

    conversion: `Conversion` of rolling friction; about: lines of provenance; expected: what the
    calibrated model gives: metric, mean, sd, runs, margin, unit, and `heaps`, the profiles of its
    heaps. What a code cannot represent is named in its README.md, and there is no deck.
    """
    for code in DECKS:
        place = emptied(Path(folder) / code)
        try:
            _refuse(code, spec, expected)
        except EngineError as error:
            write_text(_words().refused(NAMES[code], error), place / "README.md")
            continue
        known = told(code, NAMES[code], conversion, expected)
        state = _words().state(NAMES[code], known, expected)
        write_deck(code, spec, conversion, about, expected, place, state)


def emptied(place: Path) -> Path:
    """A folder without the deck of another point, and without what that gave."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    return place


def _refuse(code, spec, expected):
    if spec.experiment != "heap":
        raise EngineError(f"a deck pours a heap; this study calibrates a {spec.experiment}")
    rig.refuse_lost(spec, NAMES[code], code)
    if not expected["metric"].endswith("_deg"):
        raise EngineError(f"a check compares an angle, not {expected['metric']}")


def write_deck(
    code: str,
    spec: RunSpec,
    conversion: Conversion,
    about: Sequence[str],
    expected: Mapping[str, Any],
    place: Path,
    state: str,
) -> None:
    """Write one code's deck into the folder `place`; state: the first lines of its README.md. The
    others as `write_decks` takes them."""
    pour_file(code, spec, conversion, about, place)
    write_text(to_yaml(spec.model_dump(mode="json")), place / "spec.yaml")
    kept = {"code": code, "about": list(about), "rolling": conversion.found, "heaps": []}
    write_json(place / "expected.json", kept | dict(expected))
    write_text(_words().check(NAMES[code]), place / "check.py")
    files = [p.name for p in sorted(place.iterdir())]
    state = "\n\n".join(p if p[0] == "|" else fill(p, 100) for p in state.split("\n\n"))
    program = {"liggghts": "liggghts", "lammps": "lmp"}[code]
    notes = conversion.sentences("elastic-plastic")
    text = _words().readme(NAMES[code], code, program, state, expected, files, notes)
    write_text(text, place / "README.md")


def _words():
    return macros("calibration.telling.export", "decks")


def engine_of(code: str) -> Any:
    """Module of the engine that runs a code's decks."""
    return import_module(f"{engines.__name__}.{code}")


def pour_file(
    code: str, spec: RunSpec, conversion: Conversion, about: Sequence[str], place: Path
) -> None:
    """Write what the program itself reads into the folder `place`: deck, material block and what
    these name."""
    lines = [*about, *left_out(spec, code)]
    engine = engine_of(code)
    engine.deck(spec, place, engine.block(granulate(spec), conversion, lines))


def scatter_of_one(expected: Mapping[str, Any]) -> float:
    """Half width of the interval in which ONE_HEAP of single heaps of the calibrated model lie."""
    n = expected["runs"]
    quantile = scipy.stats.t.ppf(0.5 + 0.5 * ONE_HEAP, n - 1)
    return float(quantile * expected["sd"] * math.sqrt(1.0 + 1.0 / n))


@dataclass(frozen=True)
class Deck:
    """A deck as `write_deck` left it."""

    folder: Path
    code: str
    spec: RunSpec
    expected: Mapping[str, Any]

    @classmethod
    def read(cls, folder: str | Path) -> "Deck":
        """The deck in a folder. Raises InputError where there is none."""
        folder = Path(folder)
        path = folder / "expected.json"
        if not path.is_file():
            allowed = "the folder of an exported deck: results/NAME/exports/lammps"
            why = folder / "README.md"  # of what could not be written as a deck
            told = f": {why} says why there is none" if why.is_file() else ""
            raise InputError(f"is no deck{told}", path=folder, allowed=allowed)
        expected = read_json(path)
        if not isinstance(expected, dict) or expected.get("code") not in DECKS:
            raise InputError("says no code", path=path, key="code", allowed=" or ".join(DECKS))
        return cls(folder, expected["code"], load_spec(folder / "spec.yaml"), expected)

    @property
    def name(self) -> str:
        """Of the code, in words."""
        return NAMES[self.code]

    @property
    def conversion(self) -> Conversion:
        """`Conversion` of its rolling friction."""
        return Conversion(self.spec, self.expected["rolling"])


def heaps_there(deck: Deck, seeds: Sequence[int], timeout_s: float) -> list[dict[str, float]]:
    """Profiles of heaps in the target code; a heap without one is told and left out. Raises
    EngineError where the program is missing."""
    engine = engine_of(deck.code)
    version = engine.version()

    def pour(spec, place):
        pour_file(deck.code, spec, deck.conversion, ["a heap of a check"], place)
        read = [path.read_bytes() for path in sorted(place.iterdir())]

        def start():
            return engine.start(spec, place, timeout_s)[1]

        return [version.encode(), *read], start

    return _heaps(deck, seeds, pour, deck.name)


def heaps_here(deck: Deck, seeds: Sequence[int]) -> list[dict[str, float]]:
    """Profiles of heaps of the calibrated model: those that the deck brings, or as many as `seeds`,
    poured now."""
    if len(deck.expected["heaps"]) >= FEWEST:
        return list(deck.expected["heaps"])

    def pour(spec, place):
        mapping = spec.model_dump(mode="json")
        key = [engine_fingerprint().encode(), json.dumps(mapping, sort_keys=True).encode()]

        def start():
            engines.make(mapping, place)
            with np.load(place / "final.npz") as state:
                return {name: state[name] for name in ("position", "radius", "velocity")}

        return key, start

    return _heaps(deck, seeds, pour, "the calibrated model")


def _heaps(deck, seeds, pour, where):
    """pour(spec, folder) -> (bytes that name the heap, function that gives its last state)."""
    found = []
    for seed in seeds:
        with TemporaryDirectory() as folder:
            spec = parse_spec(overlay(deck.spec.model_dump(mode="json"), {"seed": seed}))
            parts, start = pour(spec, Path(folder))
            try:
                found.append(_kept(deck, parts, start))
            except DemError as error:
                print(f"{where}, seed {seed}: {error}", file=sys.stderr)
    if len(found) < min(FEWEST, len(seeds)) and len(seeds) >= FEWEST:
        raise DemError(f"{where}: {len(found)} of {len(seeds)} heaps have a profile")
    return found


def _kept(deck, parts, start):
    """The profile of a heap, from the deck's folder where it was poured before."""
    name = hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]
    path = deck.folder / "heaps" / f"{name}.json"
    try:
        kept = read_json(path)
    except (OSError, DamagedError):
        kept = None
    if not isinstance(kept, dict) or not kept.keys() <= set(READERS) | {"error"}:
        state = start()
        try:
            kept = profile(
                *(state[key] for key in ("position", "radius", "velocity")),
                Rig(deck.spec.geometry).plate_radius,
            )
        except MeasureError as error:
            kept = {"error": str(error)}
        path.parent.mkdir(exist_ok=True)
        write_json(path, kept)
    if "error" in kept:
        raise MeasureError(kept["error"])
    return kept


def check(folder: str | Path, seeds: int = SEEDS, timeout_s: float = 1e6) -> int:
    """Pour `seeds` heaps of a deck in its code, hold them against the calibrated model's and say
    how they compare; returns 0 where all quantities hold, 1 where one does not."""
    deck = Deck.read(folder)
    own = range(deck.spec.seed, deck.spec.seed + seeds)
    there = heaps_there(deck, own, timeout_s)
    rows = rows_of(deck.spec, deck.expected["margin"], there, heaps_here(deck, own))
    print(_words().checked(deck.name, rows, len(there), READERS), end="")
    return int(any(row.verdict != "holds" for row in rows))
