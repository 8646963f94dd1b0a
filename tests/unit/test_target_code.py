"""Decks in their target code: the second reader on heaps whose shape is known, the judgement, and
the search on a made-up code."""

import json

import numpy as np
import pytest
from test_measure import PLATE, cone

from benchmarks import decks as trial_heaps
from calibration.engines import lammps
from calibration.engines.conversion import Conversion
from calibration.study.config import overlay
from calibration.telling.export import decks as trials
from calibration.telling.export.decks import (
    READERS,
    Deck,
    heaps_there,
    margins_of,
    profile,
    rows_of,
    write_decks,
)
from dem.errors import InputError
from dem.spec import parse_spec
from facts import tells
from small_heap import SPEC

EXPECTED = {
    "metric": "angle_of_repose_deg", "mean": 30.0, "sd": 1.0, "runs": 8, "margin": 2.0,
    "unit": "deg",
}  # fmt: skip
NUMBERS = np.linspace(30.0, 36.0, len(READERS))
"""A profile of the calibrated model: any numbers."""

NO_ROTATION = {
    "path": "no_rotation", "rolling_friction": 5.0, "static_friction": 0.3,
    "stiffness_factor": 2.25, "damping_ratio": 0.3,
}  # fmt: skip


def heap(values):
    return dict(zip(READERS, map(float, values), strict=True))


def heaps(mean, count=8, sd=1.0, seed=0):
    """Profiles that scatter about `mean` (7,)."""
    rng = np.random.default_rng(seed)
    z = rng.normal(0.0, sd, (count, len(READERS)))
    return [heap(mean + row) for row in z - z.mean(axis=0)]


@pytest.fixture
def deck(tmp_path):
    """A deck for LAMMPS that brings eight heaps of the calibrated model."""
    spec = parse_spec(SPEC)
    write_decks(spec, Conversion(spec), [], EXPECTED | {"heaps": heaps(NUMBERS)}, tmp_path)
    return Deck.read(tmp_path / "lammps")


@pytest.mark.parametrize("angle", [15, 25, 40])
def test_a_cone_has_its_angle_height_and_foot_by_both_readers(angle):
    """The grains lie evenly below the surface, a radius over the sine of the angle within the rim:
    nine tenths of a disc's area lie within the root of 0.9 of its radius."""
    found = profile(*cone(angle), PLATE)
    height = 1e3 * PLATE * np.tan(np.radians(angle))
    assert found["envelope_angle_deg"] == pytest.approx(angle, abs=0.5)
    assert found["envelope_height_mm"] == pytest.approx(height, rel=0.02)
    for name in ("angle_of_repose_deg", "radial_angle_deg"):
        assert found[name] == pytest.approx(angle, abs=0.1)
    disc = 1e3 * (PLATE - 1e-3 / np.sin(np.radians(angle)))
    assert found["foot_mm"] == pytest.approx(np.sqrt(0.9) * disc, rel=0.01)


def test_the_envelope_tells_a_flat_top_which_the_flanks_do_not():
    sharp, cut = cone(30), cone(30, top=0.4 * PLATE * np.tan(np.radians(30)))
    whole, less = (profile(*scene, PLATE) for scene in (sharp, cut))
    assert abs(whole["angle_of_repose_deg"] - less["angle_of_repose_deg"]) < 0.5
    assert whole["envelope_angle_deg"] - less["envelope_angle_deg"] > 8.0


def test_margins_come_from_the_scatter_and_never_fall_below_a_grain(deck):
    """Two standard deviations of 1.5 are 3; half a grain of 5.8 mm is 2.9 mm, and the study's
    margin is 2 degrees."""
    wide = heaps(NUMBERS, sd=1.5, count=4000, seed=1)
    allowed = margins_of(deck.spec, deck.expected["margin"], wide)
    assert allowed["radial_angle_deg"] == pytest.approx(3.0, rel=0.05)
    narrow = margins_of(deck.spec, deck.expected["margin"], heaps(NUMBERS, sd=0.1))
    assert narrow["radial_angle_deg"] == 2.0
    assert narrow["height_mm"] == pytest.approx(2.9)
    assert narrow["foot_mm"] == pytest.approx(5.8)
    assert narrow["on_plate"] == pytest.approx(8.0)  # of 400


def test_a_deck_holds_misses_or_is_left_open(deck):
    at, here = (deck.spec, deck.expected["margin"]), heaps(NUMBERS)
    same = rows_of(*at, heaps(NUMBERS, seed=2), here)
    assert {row["verdict"] for row in same} == {"holds"}
    off = NUMBERS + np.where([name == "envelope_angle_deg" for name in READERS], 5.0, 0.0)
    rows = {row["quantity"]: row for row in rows_of(*at, heaps(off, seed=2), here)}
    assert rows.pop("envelope_angle_deg")["verdict"] == "misses"
    assert {row["verdict"] for row in rows.values()} == {"holds"}
    wild = rows_of(*at, heaps(NUMBERS, seed=2, count=4, sd=12.0), here)
    assert {row["verdict"] for row in wild} == {"open"}


def first_line(folder, code, law, metric="radial_angle_deg", found=None):
    """Of the deck of a study with a rolling law, not corrected, as one line; found: what the search
    for other codes' numbers says."""
    spec = parse_spec(overlay(SPEC, {"laws": {"rolling": law}}))
    expected = EXPECTED | {"metric": metric, "heaps": []}
    write_decks(spec, Conversion(spec, found), [], expected, folder)
    return " ".join((folder / code / "README.md").read_text().split("\n\n")[1].split())


@pytest.mark.parametrize("metric", ["angle_of_repose_deg", "radial_angle_deg"])
def test_the_first_line_of_a_deck_says_by_how_much_its_angle_misses(tmp_path, metric):
    """Type A in LIGGGHTS, which has no such law: the difference of the means of the kept heaps, and
    as margin two standard deviations of ours, no less than the study's 2 degrees."""
    heaps = trials.trials()["trials"]["constant_torque"]["heaps"]
    there, here = (np.array([h[metric] for h in heaps[c]]) for c in ("liggghts", trials.OWN))
    margin = max(EXPECTED["margin"], 2.0 * here.std(ddof=1))
    difference = there.mean() - here.mean()
    assert difference < -margin
    said = first_line(tmp_path, "liggghts", "constant_torque", metric=metric)
    assert tells(said, "NOT CORRECTED", "LIGGGHTS", "MISSES")
    assert f"{READERS[metric]} {difference:+.2f} deg (90 %" in said
    assert f"margin {margin:.2f}" in said
    # the study's own reader comes first
    assert said.index(READERS[metric]) == min(said.index(READERS[m]) for m in trials.ANGLES)


def test_no_miss_is_told_of_a_law_that_holds_or_was_not_tried(tmp_path, monkeypatch):
    assert "MISSES" in first_line(tmp_path, "lammps", "elastic_plastic")
    assert "MISSES" not in first_line(tmp_path, "liggghts", "elastic_plastic")
    known = trials.trials()
    monkeypatch.setattr(trials, "trials", lambda: known | {"trials": {}})
    untried = first_line(tmp_path, "liggghts", "constant_torque")
    assert tells(untried, "NOT CORRECTED", "LIGGGHTS")
    assert "MISSES" not in untried
    assert "constant_torque" in untried


@pytest.mark.parametrize(
    ("changes", "found", "expected"),
    [
        ({"laws": {"rolling": "elastic_plastic"}}, None, "elastic_plastic"),
        (trial_heaps.KINDS["elastic_plastic, sjkr"]["changes"], None, "elastic_plastic, sjkr"),
        (
            {"laws": {"rolling": "elastic_plastic"}, "particles": {"sizes": trial_heaps.SIZES}},
            None,
            "elastic_plastic, sieve curve",
        ),
        ({"laws": {"rolling": "constant_torque"}}, None, "constant_torque"),
        ({"laws": {"rolling": "constant_torque"}}, NO_ROTATION, "constant_torque, converted"),
        ({"laws": {"rolling": "constant_torque_relative"}}, None, None),
    ],
)
def test_a_deck_is_told_what_heaps_of_its_own_law_gave(changes, found, expected):
    spec = parse_spec(overlay(SPEC, changes))
    assert trials.trial_like("liggghts", Conversion(spec, found)) == expected


def test_a_folder_without_a_deck_or_of_a_code_that_has_none_is_refused(deck, tmp_path):
    with pytest.raises(InputError) as error:
        Deck.read(tmp_path)
    assert error.value.path == tmp_path
    path = deck.folder / "expected.json"
    path.write_text(json.dumps(deck.expected | {"code": "edem"}))
    with pytest.raises(InputError) as error:
        Deck.read(deck.folder)
    assert (error.value.path, error.value.key) == (path, "code")


def test_heaps_are_kept_and_a_heap_without_a_profile_is_told(deck, monkeypatch, capsys):
    """A program that stands in: it starts once for a seed, and one of its heaps is none."""
    started = []

    def start(spec, folder, timeout_s):
        started.append(spec.seed)
        position, radius, velocity = cone(25)
        flat = position * [1.0, 1.0, 0.0] + [0.0, 0.0, 1e-3]
        place = flat if spec.seed == 3 else position
        return {}, {"position": place, "radius": radius, "velocity": velocity}

    monkeypatch.setattr(lammps, "version", lambda: "1")
    monkeypatch.setattr(lammps, "start", start)
    for _ in range(2):
        found = heaps_there(deck, range(1, 6), 60.0)
        assert len(found) == 4
        assert "seed 3" in capsys.readouterr().err
    assert started == [1, 2, 3, 4, 5]
    kept = next((deck.folder / "heaps").glob("*.json"))
    kept.write_text(kept.read_text()[:20])  # cut off
    heaps_there(deck, range(1, 6), 60.0)
    assert len(started) == 6
