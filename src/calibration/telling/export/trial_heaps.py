"""Pour the heaps of `trials.json` again, of its own run spec: `python -m
calibration.telling.export.trial_heaps` writes the file. It needs LIGGGHTS and LAMMPS. Cost: about
five minutes of one core. Heaps are kept in results/trials or the folder that is named, so that a
call that was cut off goes on where it stopped."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.engines.blocks.conversion import Conversion
from calibration.study.config import overlay
from calibration.telling.export.decks import BLOCKS, engine_of, write_deck
from calibration.telling.export.target_code import SEEDS, Deck, heaps_here, heaps_there
from calibration.telling.export.trials import OWN, TRIALS, trials
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import parse_spec

if TYPE_CHECKING:
    from dem.spec import RunSpec


LAWS = ("elastic_plastic", "constant_torque")
"""Rolling laws that are tried. Of `constant_torque_relative` three of the first five heaps here did
not rest within the three seconds."""
STATED = {
    "metric": "radial_angle_deg", "mean": 0.0, "sd": 0.0, "runs": 1, "margin": 2.0, "unit": "deg",
    "heaps": [],
}  # fmt: skip
"""What the decks of the trial state of the calibrated model: nothing of it is used."""


def poured(law: str, folder: str | Path, seeds: int = SEEDS) -> dict[str, list[dict[str, float]]]:
    """{code: profiles of its heaps} of one rolling law, this engine's among them; folder: where the
    decks and their heaps are kept."""
    spec = parse_spec(overlay(trials()["spec"], {"laws": {"rolling": law}}))
    wanted = range(spec.seed, spec.seed + seeds)
    found: dict[str, list[dict[str, float]]] = {}
    for code in BLOCKS:
        deck = deck_in(Path(folder) / law, code, spec)
        found[code] = heaps_there(deck, 1.0, wanted, 3600.0)
        if OWN not in found:
            found[OWN] = heaps_here(deck, wanted)
    return found


def deck_in(folder: Path, code: str, spec: RunSpec) -> Deck:
    """The deck of a run spec for a code, made in a folder where it is not there yet."""
    place = folder / code
    if not (place / "expected.json").is_file():
        place.mkdir(parents=True, exist_ok=True)
        write_deck(code, spec, Conversion(spec), ["a trial"], STATED, place, "A trial.")
    return Deck.read(place)


def main(folder: str | Path = "results/trials") -> int:
    """Write trials.json."""
    by = {code: engine_of(code).version() for code in BLOCKS} | {OWN: engine_fingerprint()}
    heaps = {law: poured(law, folder) for law in LAWS}
    write_json(TRIALS, {"spec": trials()["spec"], "poured_by": by, "heaps": heaps})
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
