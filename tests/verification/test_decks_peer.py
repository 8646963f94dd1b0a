"""Exported decks run as they are: one command pours a small heap in the other program and judges
its angle, and it can say no."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from calibration import engines
from calibration.engines.blocks.conversion import Conversion
from calibration.engines.program import read_dump
from calibration.errors import ConfigError
from calibration.study.config import overlay
from calibration.telling.export.decks import BLOCKS, write_decks
from dem.grains import number_fractions
from dem.spec import parse_spec
from small_heap import SPEC

pytestmark = [pytest.mark.peer, pytest.mark.slow]

WIDE = {"metric": "angle_of_repose_deg", "mean": 30.0, "sd": 1.0, "runs": 5, "unit": "deg"}
"""No heap of such grains is flatter than 5 or steeper than 55 degrees."""


def checked(deck, expected):
    """(status, angle, words) of the one command in a deck, by what it is to expect."""
    (deck / "expected.json").write_text(json.dumps(expected))
    done = subprocess.run(
        [sys.executable, "check.py"], cwd=deck, capture_output=True, text=True, check=False
    )
    said = done.stdout + done.stderr
    found = re.search(r": ([\d.]+) deg;", said)
    return done.returncode, float(found[1]) if found else None, said


@pytest.mark.parametrize("code", BLOCKS)
def test_a_deck_runs_and_its_check_can_say_yes_and_no(tmp_path, code):
    try:
        engines.entry_of(code)
    except ConfigError as error:
        pytest.skip(str(error))
    spec = parse_spec(SPEC)
    write_decks(spec, Conversion(spec), ["a test"], WIDE | {"margin": 21.0}, tmp_path)
    status, angle, said = checked(tmp_path / code, WIDE | {"margin": 21.0})
    assert status == 0, said
    assert "agrees" in said
    status, again, said = checked(tmp_path / code, WIDE | {"margin": 1.0, "mean": angle + 10.0})
    assert status == 1, said
    assert "difference -10.00" in said
    assert again == angle  # the deck has its seed


SIEVED = {"by": "mass", "diameters_mm": [5.2, 6.4], "fractions": [0.5, 0.5]}


@pytest.mark.parametrize("code", BLOCKS)
def test_a_deck_pours_all_sizes(tmp_path, code):
    """In their numbers; of the half of 400 grains that stays on the plate a share scatters by
    3.5 %, and small grains may stay rather than large ones."""
    try:
        engines.entry_of(code)
    except ConfigError as error:
        pytest.skip(str(error))
    spec = parse_spec(overlay(SPEC, {"particles": {"sizes": SIEVED}}))
    write_decks(spec, Conversion(spec), ["a test"], WIDE | {"margin": 25.0}, tmp_path)
    status, _, said = checked(tmp_path / code, WIDE | {"margin": 25.0})
    assert status == 0, said
    radii = read_dump(tmp_path / code / "end.dump")["radius"]
    assert {f"{2e3 * r:.4g}" for r in radii} == {"5.2", "6.4"}
    share = number_fractions(spec.particles.sizes)[0]
    assert np.mean(radii < 2.9e-3) == pytest.approx(share, abs=0.1)


def test_a_deck_that_fails_gives_a_sentence(tmp_path):
    spec = parse_spec(SPEC)
    write_decks(spec, Conversion(spec), ["a test"], WIDE | {"margin": 1.0}, tmp_path)
    (tmp_path / "liggghts" / "in.liggghts").write_text("nonsense\n")
    status, angle, said = checked(tmp_path / "liggghts", WIDE | {"margin": 1.0})
    assert (status, angle) == (2, None)
    assert "LIGGGHTS" in said
    assert "Traceback" not in said
