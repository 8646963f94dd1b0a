"""Decks: folders with all that another program needs to pour the calibrated heap, and one command
that holds its heaps against the calibrated ones (`calibration.telling.export.target_code`)."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from scipy.stats import t

from calibration import engines
from calibration.engines import EngineError, blocks, rig
from calibration.engines.blocks.header import left_out
from calibration.engines.blocks.material import granulate
from calibration.files import write_text
from calibration.telling.export.parameters import to_yaml
from calibration.telling.export.trials import told
from dem.io.files import write_json

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from dem.spec import RunSpec


DECKS = ("liggghts", "lammps")
"""Codes that have decks."""
NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
"""Of YADE heaps are tried, and no deck is written."""
ONE_HEAP = 0.95
"""Share of single heaps of the calibrated model that lie within what a check allows."""
CHECK = '''\
"""Pour heaps with {name} and hold them against the calibrated ones: python check.py"""

import sys
from pathlib import Path

from calibration.interface.cli import main  # pip install granular-calibration

sys.exit(main(["deck", str(Path(__file__).parent), *sys.argv[1:]]))
'''
STATE = """\
**{known}** No heap of this study was poured in {name}: its numbers come from this project's engine,
and whether the margin of {margin:g} {unit} is met there is not known before you run the check."""
README = """\
# The calibrated heap for {name}

{state}

    python check.py

pours eight such heaps with {program}, each with its own seed, and holds their angle and their
profile against those of the calibrated model, by two readers; it ends with status 0 where all are
within their margins. The calibrated model's angle is {mean:.2f} {unit} ({runs} runs, sd {sd:.2f}).
One heap by hand: {program} -in in.{code}

| file | what it holds |
|---|---|
{files}

{notes}
"""
FILES = {
    "check.py": "the command",
    "expected.json": "what the calibrated model gives: angle, and profiles of its heaps",
    "funnel.stl": "the funnel and the wall above it [m]",
    "plate.stl": "the plate [m]",
    "spec.yaml": "the heap as a run spec of this project",
}
GRAIN = "one grain: diameter and mass"
REFUSED = "# No deck for {name}\n\nNOT WRITTEN: {reason}\n"


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
            write_text(REFUSED.format(name=NAMES[code], reason=error), place / "README.md")
            continue
        known = told(code, NAMES[code], conversion, expected)
        state = STATE.format(name=NAMES[code], known=known, **expected)
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
    write_text(CHECK.format(name=NAMES[code]), place / "check.py")
    own = {f"in.{code}": "the deck: rig, pour, rest", f"material.{_end(code)}": "laws and numbers"}
    own |= {p.name: GRAIN for p in place.glob("grain*.molecule")}
    rows = {k: v for k, v in (FILES | own).items() if (place / k).exists()}
    text = README.format(
        state="\n\n".join(p if p[0] == "|" else fill(p, 100) for p in state.split("\n\n")),
        name=NAMES[code],
        code=code,
        program={"liggghts": "liggghts", "lammps": "lmp"}[code],
        files="\n".join(f"| `{name}` | {rows[name]} |" for name in sorted(rows)),
        notes="\n".join(conversion.sentences("elastic-plastic")),
        **{name: expected[name] for name in ("mean", "unit", "runs", "sd")},
    )
    write_text(text, place / "README.md")


def engine_of(code: str) -> Any:
    """Module of the engine that runs a code's decks."""
    return import_module(f"{engines.__name__}.{code}")


def pour_file(
    code: str, spec: RunSpec, conversion: Conversion, about: Sequence[str], place: Path
) -> None:
    """Write what the program itself reads into the folder `place`: deck, material block and what
    these name."""
    lines = [*about, *left_out(spec, code)]
    block = import_module(f"{blocks.__name__}.{code}").block(granulate(spec), conversion, lines)
    engine_of(code).deck(spec, place, block)


def _end(code):
    return {"liggghts": "in", "lammps": "lammps"}[code]


def scatter_of_one(expected: Mapping[str, Any]) -> float:
    """Half width of the interval in which ONE_HEAP of single heaps of the calibrated model lie."""
    n = expected["runs"]
    quantile = t.ppf(0.5 + 0.5 * ONE_HEAP, n - 1)
    return float(quantile * expected["sd"] * math.sqrt(1.0 + 1.0 / n))
