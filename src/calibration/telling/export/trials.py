"""Heaps that were poured in other codes with a deck's numbers as they are, and what they say of the
deck of another study: each rolling law of this engine beside what the code makes of it.

`trials.json` beside this file holds the profiles; `benchmarks.decks` pours them again.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from calibration.engines.conversion import Conversion
from calibration.engines.templates import macros
from calibration.files import read_json
from calibration.study.config import overlay
from calibration.telling.export.heap_comparison import Row, rows_of
from dem.spec import RunSpec, parse_spec

TRIALS = Path(__file__).with_name("trials.json")
ANGLES = ("angle_of_repose_deg", "radial_angle_deg", "envelope_angle_deg")
OWN = "dem"
"""What `trials.json` calls this engine."""


@cache
def trials() -> dict[str, Any]:
    """Content of trials.json: the run spec, what poured the heaps, and {name: trial}: the `changes`
    of its run spec, the conversion of its numbers (`rolling`, null where they are as they are) and
    the profiles {code: [profile, ...]}."""
    return read_json(TRIALS)


def spec_of(name: str) -> RunSpec:
    """`RunSpec` of a trial."""
    kept = trials()
    return parse_spec(overlay(kept["spec"], kept["trials"][name]["changes"]))


def rows_in(code: str, name: str, margin: float) -> list[Row]:
    """A `Row` for each quantity of a trial's heaps in a code and here. margin: of an angle
    [deg]."""
    heaps = trials()["trials"][name]["heaps"]
    return rows_of(spec_of(name), margin, heaps[code], heaps[OWN])


def trial_like(code: str, conversion: Conversion) -> str | None:
    """Name of the trial in a code whose laws and whose conversion are those of a deck; the one of
    equal grains or of several sizes, as the deck's; None where none was made."""
    wanted, several = _laws(conversion.spec, conversion.found), conversion.spec.particles.sizes
    poured = {n: kept for n, kept in trials()["trials"].items() if code in kept["heaps"]}
    specs = {name: spec_of(name) for name in poured}
    found = [n for n in poured if _laws(specs[n], poured[n]["rolling"]) == wanted]
    alike = [n for n in found if bool(specs[n].particles.sizes) == bool(several)]
    return next(iter(alike or found), None)


def _laws(spec, found):
    """Return what decides how a deck's heap compares: rolling law, cohesion, and the law that the
    search chose for other codes."""
    return spec.laws.rolling, spec.laws.cohesion, found["path"] if found else None


def told(code: str, name: str, conversion: Conversion, expected: Mapping[str, Any]) -> str:
    """Sentences for the head of a deck that was not corrected: by how much its angle is off in its
    code, as far as heaps of the same law tell. name: of the code, in words; expected: what the
    calibrated model gives."""
    like, words = trial_like(code, conversion), macros("calibration.telling.export", "decks")
    if like is None:
        return words.told(name, conversion, 0, 0, None, [], "")
    heaps = trials()["trials"][like]["heaps"]
    rows = [r for r in rows_in(code, like, expected["margin"]) if r.quantity in ANGLES]
    there, here = len(heaps[code]), len(heaps[OWN])
    return words.told(name, conversion, there, here, spec_of(like), rows, expected["metric"])
