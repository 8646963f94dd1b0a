"""Exported decks in the programs that they are made for: one command pours heaps and judges angle
and profile by two readers, it can say no, and where the law differs it finds the number that gives
the calibrated heap.

The heaps are small and scatter, so no number is pinned that another build of a program would
shift. What is asked for is far beyond the scatter: with the same numbers LAMMPS' heaps are eight
to eleven degrees flatter.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from benchmarks.decks import SIZES
from calibration import engines
from calibration.engines.conversion import Conversion
from calibration.study.config import overlay
from calibration.telling.export.decks import (
    DECKS,
    Deck,
    heaps_here,
    heaps_there,
    rows_of,
    write_decks,
)
from dem.grains.sizes import number_fractions
from dem.spec import parse_spec
from other_codes import entry_or_skip
from small_heap import SPEC

pytestmark = [pytest.mark.peer, pytest.mark.slow]

STATED = {
    "metric": "angle_of_repose_deg", "mean": 22.0, "sd": 2.0, "runs": 8, "margin": 2.0,
    "unit": "deg", "heaps": [],
}  # fmt: skip
"""What a study states; the heaps of the calibrated model are poured by the check itself."""
C500 = overlay(SPEC, {"particles": {"count": 500}})


def deck_of(code, mapping, folder):
    """The deck of a run spec (a mapping); skips the test where the program is missing."""
    entry_or_skip(code)
    spec = parse_spec(mapping)
    write_decks(spec, Conversion(spec), ["a test"], STATED, folder)
    return Deck.read(folder / code)


@pytest.mark.parametrize("code", DECKS)
def test_a_check_says_yes_to_its_own_heaps_and_no_to_others(tmp_path, code):
    """By the one command in the folder. The program's own heaps, taken for the calibrated ones, are
    met; they are poured once."""
    deck = deck_of(code, C500, tmp_path)
    there = heaps_there(deck, range(1, 6), 600.0)
    poured = set((deck.folder / "heaps").iterdir())

    def checked(shift):
        heaps = [heap | {"radial_angle_deg": heap["radial_angle_deg"] + shift} for heap in there]
        (deck.folder / "expected.json").write_text(json.dumps(deck.expected | {"heaps": heaps}))
        return subprocess.run(
            [sys.executable, "check.py", "--seeds", "5"],
            cwd=deck.folder, capture_output=True, text=True, check=False, env=os.environ,
        )  # fmt: skip

    other = checked(15.0)
    assert other.returncode == 1, other.stdout + other.stderr
    assert "-15.00" in other.stdout
    assert "MISSES" in other.stdout
    same = checked(0.0)
    assert "misses" not in same.stdout
    assert set((deck.folder / "heaps").iterdir()) == poured


def test_liggghts_needs_no_other_number_for_the_law_that_it_has(tmp_path):
    """The law of the calibration is LIGGGHTS' own: no quantity is off by more than its margin."""
    deck = deck_of("liggghts", C500, tmp_path)
    seeds = range(1, 9)
    rows = rows_of(
        deck.spec,
        deck.expected["margin"],
        heaps_there(deck, seeds, 600.0),
        heaps_here(deck, seeds),
    )
    assert "misses" not in {row["verdict"] for row in rows}


@pytest.mark.parametrize("code", DECKS)
def test_a_deck_pours_all_sizes(tmp_path, code):
    """In their numbers; of the half of 400 grains that stays on the plate a share scatters by
    3.5 %, and small grains may stay rather than large ones."""
    deck = deck_of(code, overlay(SPEC, {"particles": {"sizes": SIZES}}), tmp_path)
    state = engines.engines()[code].simulate(
        deck.spec, deck.folder, {"settings": {"timeout_s": 600.0}}
    )[1]
    radii = state["radius"]
    assert {f"{2e3 * r:.4g}" for r in radii} == {"5.2", "6.4"}
    share = number_fractions(deck.spec.particles.sizes)[0]
    assert np.mean(radii < 2.9e-3) == pytest.approx(share, abs=0.1)
