"""Decks: folders with all that another program needs to pour the calibrated heap, and one command
that checks its angle.

`python check.py` in such a folder starts the program on the deck as it is. It measures the heap as
this engine's heaps are measured, and compares the angle with that of the calibrated model.
"""

from __future__ import annotations

import math
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scipy.stats import t

from calibration import engines
from calibration.engines import EngineError, rig
from calibration.engines.blocks import lammps, liggghts
from calibration.engines.blocks.header import left_out
from calibration.engines.blocks.material import granulate
from calibration.files import read_json, write_text
from calibration.telling.export.parameters import to_yaml
from dem.errors import DemError
from dem.io.files import write_json
from dem.spec import load_spec

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from dem.spec import RunSpec


BLOCKS = {"liggghts": liggghts, "lammps": lammps}
"""Code that has decks -> module that writes its material block."""
NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS"}
ONE_HEAP = 0.95
"""Share of single heaps of the calibrated model that lie within what a check allows."""
CHECK = '''\
"""Pour this heap with {name} and check its angle: python check.py"""

import sys

from calibration.telling.export.decks import check  # pip install granular-calibration

sys.exit(check("{code}"))
'''
KNOWN_ANGLE = {
    "liggghts": "With the same numbers and type C rolling, heaps of 400 grains had 19.9 deg in "
    "LIGGGHTS and 19.7 deg here (four seeds)",
    "lammps": "EXPECT A FLATTER HEAP: with the same numbers and type C rolling, heaps of 400 "
    "grains had 15.7 deg in LAMMPS and 19.7 deg here (four seeds), and a study's heaps of 500 "
    "grains were 4.9 deg flatter (95 %: 2.6 to 7.2; eight seeds of each) by a line along their "
    "envelope, of which the check's own metric saw 0.7 deg",
}
"""Code: what is known of its angle; docs/verification-engines.md has the runs."""
STATE = """\
**NOT CORRECTED IN {upper}.** No heap of this study was poured in {name}: its numbers come from this
project's engine, and whether the margin of {margin:g} {unit} is met there is not known before you
run the check. {known} (docs/verification-engines.md). One heap is one draw: for the margin pour
several, with other seeds in `in.{code}`."""
README = """\
# The calibrated heap for {name}

{state}

    python check.py

starts {program} on `in.{code}`, measures the heap that it leaves in `end.dump` and compares the
angle with that of the calibrated model: {mean:.2f} {unit} ({runs} runs, sd {sd:.2f}). It ends with
status 0 where the difference is at most {allowed:.2f} {unit}: the margin of {margin:g} and what one
heap scatters ({share:.0%}). By hand: {program} -in in.{code}

| file | what it holds |
|---|---|
{files}

{notes}
"""
FILES = {
    "check.py": "the command",
    "end.dump": "left by a run: the heap at rest",
    "expected.json": "what the calibrated model gives",
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
    calibrated model gives: metric, mean, sd, runs, margin, unit. What a code cannot represent is
    named in its README.md, and there is no deck.
    """
    for code in BLOCKS:
        place = Path(folder) / code
        shutil.rmtree(place, ignore_errors=True)  # a deck of another point, and what it gave
        place.mkdir(parents=True)
        try:
            _refuse(code, spec, expected)
        except EngineError as error:
            write_text(REFUSED.format(name=NAMES[code], reason=error), place / "README.md")
            continue
        _write_deck(code, spec, conversion, about, expected, place)


def _refuse(code, spec, expected):
    if spec.experiment != "heap":
        raise EngineError(f"a deck pours a heap; this study calibrates a {spec.experiment}")
    rig.refuse_lost(spec, NAMES[code], code)
    if not expected["metric"].endswith("_deg"):
        raise EngineError(f"a check compares an angle, not {expected['metric']}")


def _write_deck(code, spec, conversion, about, expected, place):
    lines = [*about, *left_out(spec, code)]
    block = BLOCKS[code].block(granulate(spec), conversion, lines)
    import_module(f"calibration.engines.{code}").deck(spec, place, block)
    write_text(to_yaml(spec.model_dump(mode="json")), place / "spec.yaml")
    write_json(place / "expected.json", expected)
    write_text(CHECK.format(name=NAMES[code], code=code), place / "check.py")
    own = {f"in.{code}": "the deck: rig, pour, rest", f"material.{_end(code)}": "laws and numbers"}
    own |= {p.name: GRAIN for p in place.glob("grain*.molecule")}
    rows = {k: v for k, v in (FILES | own).items() if (place / k).exists() or k == "end.dump"}
    state = STATE.format(
        upper=NAMES[code].upper(), name=NAMES[code], known=KNOWN_ANGLE[code], code=code, **expected
    )
    text = README.format(
        state="\n".join(textwrap.wrap(state, 100)),
        name=NAMES[code],
        code=code,
        program={"liggghts": "liggghts", "lammps": "lmp"}[code],
        allowed=allowed(expected),
        share=ONE_HEAP,
        files="\n".join(f"| `{name}` | {rows[name]} |" for name in sorted(rows)),
        notes="\n".join(conversion.sentences("elastic-plastic")),
        **expected,
    )
    write_text(text, place / "README.md")


def _end(code):
    return {"liggghts": "in", "lammps": "lammps"}[code]


def allowed(expected: Mapping[str, Any]) -> float:
    """Greatest difference of one heap's angle from the calibrated mean that a check takes: the
    margin and the prediction interval of one heap."""
    return expected["margin"] + scatter_of_one(expected)


def scatter_of_one(expected: Mapping[str, Any]) -> float:
    """Half width of the interval in which ONE_HEAP of single heaps of the calibrated model lie."""
    n = expected["runs"]
    quantile = t.ppf(0.5 + 0.5 * ONE_HEAP, n - 1)
    return float(quantile * expected["sd"] * math.sqrt(1.0 + 1.0 / n))


def check(code: str, folder: str | Path = ".", timeout_s: float = 1e6) -> int:
    """Run the deck in `folder` with its program and say how its angle compares; returns 0 where it
    agrees, 1 where it does not, 2 where there is no angle."""
    folder = Path(folder).resolve()
    try:
        spec, expected = load_spec(folder / "spec.yaml"), read_json(folder / "expected.json")
        module = import_module(f"{engines.__name__}.{code}")
        metrics, _ = module.start(spec, folder, timeout_s)
        found = metrics[expected["metric"]]
    except (DemError, OSError) as error:
        print(f"{NAMES[code]}: {error}", file=sys.stderr)
        return 2
    difference, most = found - expected["mean"], allowed(expected)
    agrees = abs(difference) <= most
    print(
        f"{NAMES[code]}: {found:.2f} {expected['unit']}; the calibrated model gives "
        f"{expected['mean']:.2f} {expected['unit']}; difference {difference:+.2f}, allowed "
        f"{most:.2f}: {'agrees' if agrees else 'differs'}"
    )
    return 0 if agrees else 1
