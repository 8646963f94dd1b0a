"""Heaps that were poured in other codes with a deck's numbers as they are, and what they say of the
deck of another study: each rolling law of this engine beside what the code makes of it.

`trials.json` beside this file holds the profiles; `trial_heaps` pours them again.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.files import read_json
from calibration.telling.export.heap_comparison import Row, rows_of
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion


TRIALS = Path(__file__).with_name("trials.json")
ANGLES = ("angle_of_repose_deg", "radial_angle_deg", "envelope_angle_deg")
OWN = "dem"
"""What `trials.json` calls this engine."""


@cache
def trials() -> dict[str, Any]:
    """Content of trials.json: the run spec without its law, what poured the heaps, and of each law
    the profiles {code: [profile, ...]}."""
    return read_json(TRIALS)


def trial(code: str, law: str, margin: float) -> list[Row] | None:
    """A `Row` for each quantity of the heaps of a rolling law in a code and here; None where none
    were poured. margin: of an angle [deg]."""
    heaps = trials()["heaps"].get(law)
    if heaps is None or code not in heaps:
        return None
    return rows_of(parse_spec(trials()["spec"]), margin, heaps[code], heaps[OWN])


def told(code: str, name: str, conversion: Conversion, expected: Mapping[str, Any]) -> str:
    """Sentences for the head of a deck that was not corrected: by how much its angle is off in its
    code, as far as heaps of the same law tell. name: of the code, in words; expected: what the
    calibrated model gives."""
    law, upper = conversion.spec.laws.rolling, name.upper()  # type: ignore[attr-defined]  # a field for each law
    rows = None if conversion.found else trial(code, law, expected["margin"])
    if rows is None:
        how = "with numbers found by a search" if conversion.found else f"of the law {law}"
        return f"NOT CORRECTED IN {upper}. No heaps {how} were tried there."
    heaps, spec = trials()["heaps"][law], parse_spec(trials()["spec"])
    which = (
        f"{len(heaps[code])} heaps there and {len(heaps[OWN])} here of {spec.particles.count} "
        f"grains, the law {law} and the same numbers"
    )
    missed = [row for row in rows if row.quantity in ANGLES and row.verdict == "misses"]
    if missed:
        own = [row for row in missed if row.quantity == expected["metric"]]
        first = (own or missed)[0]
        others = "; ".join(row.told for row in missed if row is not first)
        return (
            f"NOT CORRECTED IN {upper}, AND IT MISSES ITS ANGLE THERE, as heaps tell that were "
            f"tried: {first.told}{'; ' if others else ''}{others} ({which})."
        )
    angles = "; ".join(row.told for row in rows if row.quantity in ANGLES)
    return f"NOT CORRECTED IN {upper}. Heaps that were tried miss no angle: {angles} ({which})."
