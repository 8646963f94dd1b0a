"""A deck in the code that it was made for: several heaps of it beside the calibrated model's.

A law of the same name is not the same law: LAMMPS' rolling spring is a constant, and its heaps are
flatter with the same numbers. Who wants the numbers that LAMMPS or LIGGGHTS asks for calibrates in
it (`engine`).
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration import engines
from calibration.engines.blocks.conversion import Conversion
from calibration.files import DamagedError, read_json
from calibration.study.config import overlay
from calibration.telling.export.decks import (
    DECKS,
    NAMES,
    engine_of,
    pour_file,
)
from calibration.telling.export.heap_comparison import Row, rows_of
from calibration.telling.export.heap_profile import READERS, profile
from dem.errors import DemError, InputError, MeasureError
from dem.experiments.heap import Rig
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import load_spec, parse_spec

if TYPE_CHECKING:
    from dem.spec import RunSpec


SEEDS = 8
"""Heaps of a check, in each code."""
FEWEST = 4
"""Heaps of a code with which a difference can be tested."""


@dataclass(frozen=True)
class Deck:
    """A deck as `write_deck` left it."""

    folder: Path
    code: str
    spec: RunSpec
    expected: Mapping[str, Any]

    @classmethod
    def read(cls, folder: str | Path) -> Deck:
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
        _check(expected, path)
        return cls(folder, expected["code"], load_spec(folder / "spec.yaml"), expected)

    @property
    def name(self) -> str:
        """Of the code, in words."""
        return NAMES[self.code]

    @property
    def conversion(self) -> Conversion:
        """`Conversion` of its rolling friction."""
        return Conversion(self.spec, self.expected["rolling"])

    def with_seed(self, seed: int) -> dict[str, Any]:
        """Run spec (a mapping) of this heap with another seed."""
        return overlay(self.spec.model_dump(mode="json"), {"seed": seed})


KEPT = {
    "about": list, "heaps": list, "rolling": dict | None, "margin": float | int, "mean": float,
    "sd": float, "runs": int, "unit": str,
}  # fmt: skip
"""What a deck says of the calibrated model beside its code."""


def _check(expected, path):
    """Raise InputError for a file that `write_deck` has not left."""
    again = "the file as it was exported; the stage `export` makes it again"
    for key, kind in KEPT.items():
        if key not in expected or not isinstance(expected[key], kind):
            raise InputError("is not as exported", path=path, key=key, allowed=again)
    for n, heap in enumerate(expected["heaps"]):
        known = isinstance(heap, dict) and heap.keys() == set(READERS)
        if not known or not all(isinstance(v, float | int) for v in heap.values()):
            raise InputError("is no profile", path=path, key=f"heaps[{n}]", allowed=again)


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
            parts, start = pour(parse_spec(deck.with_seed(seed)), Path(folder))
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


def judge(
    deck: Deck, there: Sequence[Mapping[str, float]], here: Sequence[Mapping[str, float]]
) -> list[Row]:
    """A `Row` for each quantity of heaps in the target code and here."""
    return rows_of(deck.spec, deck.expected["margin"], there, here)


def check(folder: str | Path, seeds: int = SEEDS, timeout_s: float = 1e6) -> int:
    """Pour `seeds` heaps of a deck in its code, hold them against the calibrated model's and say
    how they compare; returns 0 where all quantities hold, 1 where one does not."""
    deck = Deck.read(folder)
    there = heaps_there(deck, _seeds(deck, seeds), timeout_s)
    rows = judge(deck, there, heaps_here(deck, _seeds(deck, seeds)))
    print(_table(deck, rows), end="")
    print(_verdict(deck, rows, len(there)))
    return int(any(row.verdict != "holds" for row in rows))


def _seeds(deck, count):
    return range(deck.spec.seed, deck.spec.seed + count)


def _verdict(deck, rows, heaps):
    """The first line of a deck that was checked."""
    head = deck.name
    missed = [row for row in rows if row.verdict == "misses"]
    still = [row for row in rows if row.verdict == "open"]
    if missed:
        return f"{head}. IT MISSES: {'; '.join(row.told for row in missed + still)}. {heaps} heaps."
    if still:
        return (
            f"{head}. NOT SHOWN TO HOLD with {heaps} heaps: {'; '.join(r.told for r in still)}. "
            "More seeds (--seeds) tell."
        )
    return f"{head}. It holds: each quantity of {heaps} heaps is within its margin."


def _table(deck, rows):
    lines = [
        f"| read from | here | {deck.name} | difference (90 %) | margin | |",
        "|---|---|---|---|---|---|",
    ]
    for r in rows:
        unit = f" [{r.unit}]" if r.unit else ""
        lines.append(
            f"| {READERS[r.quantity]}{unit} | {r.here:.2f} (sd {r.here_sd:.2f}) | {r.there:.2f} "
            f"(sd {r.there_sd:.2f}) | {r.difference:+.2f} ({r.low:+.2f} to {r.high:+.2f}) | "
            f"{r.margin:.2f} | {r.verdict} |"
        )
    return "\n".join(lines) + "\n"
