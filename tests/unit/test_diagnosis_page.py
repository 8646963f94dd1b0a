"""The diagnosis stands alone: a page of its own in plain words, and names that are withdrawn."""

import json

import pytest
from diagnosis_cases import residual

from calibration.figures import parameter_words
from diagnosis.extend import FIT
from diagnosis.page.markdown import first_lines, page
from diagnosis.rules import OF_SIMULATED, by_runs
from facts import tells
from frozen import FROZEN

REFERENCE = FROZEN / "table-tennis-ball"


@pytest.fixture
def ball():
    """The recorded verdict of a ball on a floor, with the keys and words that a new one has."""
    verdict = json.loads((REFERENCE / "verdict.json").read_text())
    verdict |= {"misfit": verdict["lack_of_fit"], "laws": [], "errors": [], "rows": []}
    for part in ("calibration", "calibration_extended"):
        for entry in verdict[part].values():
            entry["words"] = parameter_words("contacts.particle_wall.restitution")
    verdict["moved"] = {}
    return verdict


def missing_by(verdict, miss):
    return verdict | {"gain": verdict["gain"] | {"held_out_rmse_after_all_errors": miss}}


def test_a_named_cause_that_the_engine_does_not_confirm_is_only_the_best_of_those_tried(ball):
    found = by_runs(missing_by(ball, 5.13), OF_SIMULATED)
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["best_tried"] == ["air_drag"]
    text = page(found)
    assert "air drag" in text.splitlines()[2]
    assert "5.1 standard errors" in text
    assert by_runs(missing_by(ball, FIT), OF_SIMULATED)["causes"] == ["air_drag"]


def law(**more):
    """A law as verdict.json has it."""
    own = {"experiment": "drop", "slot": "restitution", "state": ["speed"], "names": [],
           "forms": [], "values": [], "unit": "1", "gain": None, "rivals": [],
           "evidence": 9.0, "sentence": "The restitution falls from 0.95 to 0.90."}  # fmt: skip
    return own | more


MISFIT = {"chi_square": 20.0, "freedom": 19.0, "p": 0.4}


def test_the_first_sentence_says_what_is_wrong_by_how_much_and_where(ball):
    """Of four settings whose rebound of 90 mm is 10 mm too low at 200 mm and met elsewhere."""
    read = [(50.0, 100.0), (100.0, 100.0), (200.0, 90.0), (400.0, 100.0)]
    rows = [residual("drop", {"drop_height_mm": h}, m, 100.0) for h, m in read]
    what, cause, cost = first_lines(ball | {"residuals": rows})
    assert "rebound" in what
    assert "5.6 %" in what  # of the reading: the root of a quarter of 11 % squared
    assert tells(what, "drop height", "200 mm")
    assert "11 % above the readings" in what
    assert "air drag" in cause
    assert "3.9" in cost
    assert "1.2" in cost


@pytest.mark.parametrize(
    ("verdict", "more", "cause"),
    [
        ("adequate", {"causes": [], "misfit": MISFIT}, "no single row"),
        ("identified", {}, "air"),
        ("discovered", {"causes": [], "laws": [law()]}, "falls from 0.95 to 0.90"),
        ("discovered", {"causes": [], "laws": [law(sentence="")]}, "restitution of speed"),
        ("ambiguous", {"causes": [], "laws": [law(rivals=[{"words": "a zero off", "behind": 0}])]},
         "a zero off"),
        ("error", {"causes": [], "errors": [{"experiment": "drop", "of": "drop_height_mm",
         "what": "one level", "level": 120.0, "sd": 0.1, "p": 0.01, "rivals": [],
         "sentence": "Line 9 reads like 132 mm."}]}, "132 mm"),
        ("error", {"causes": [], "errors": [], "rows": [{"experiment": "drop", "line": 9,
         "standard_deviations": 15.0, "sentence": "Line 9 lies off."}]}, "line 9"),
        ("unexplained", {"causes": [], "best_tried": ["air_drag"]}, "air drag,"),
    ],
)  # fmt: skip
def test_the_second_sentence_is_the_cause_and_none_contradicts_it(ball, verdict, more, cause):
    changed = ball | {"verdict": verdict} | more
    lines = first_lines(changed)
    assert cause in lines[1]
    off = [line for line in lines if " misses " in line or "measure next" in line.lower()]
    assert bool(off) == (verdict != "adequate")
    assert all(line.endswith(".") for line in lines)
    text = page(changed)
    assert lines[0] in text
    assert "Nothing is missing" not in text
    assert ("measure next" in text) == (verdict != "adequate")


def test_every_experiment_in_which_something_is_found_is_told(ball):
    drops, tilts = [(50.0, 109.0), (90.0, 100.0)], [(2.0, 100.0), (9.0, 96.0)]
    rows = [residual("drop", {"drop_height_mm": h}, read, 100.0) for h, read in drops]
    rows += [residual("tilt", {"tilt_rate_deg_s": r}, read, 100.0) for r, read in tilts]
    hand = law(experiment="tilt", slot="reading", state=["rate"],
               names=["tilt_detection_lag"], sentence="The reading adds 1° at 2 °/s.")  # fmt: skip
    speed = law(evidence=20.0)
    two = {"verdict": "discovered", "causes": [], "residuals": rows, "laws": [speed, hand]}
    what, cause, _ = first_lines(ball | two)
    assert tells(what, "rebound", "drop height", "50 mm", "sliding angle", "tilt rate", "9 °/s")
    assert tells(cause, "falls from 0.95 to 0.90", "tilt detection lag", "adds 1°")
    assert "sliding angle" not in first_lines(ball | two | {"laws": [speed]})[0]


def test_a_faulty_row_comes_first_and_asks_for_its_own_setting_again(ball):
    row = {"experiment": "drop", "line": 9, "levers": {"drop_height_mm": 90.0}, "value": 61.5,
           "expected": 52.25, "standard_deviations": 15.2, "sentence": "Line 9 lies off.",
           "reads_like": {"lever": "drop_height_mm", "value": 120.0}}  # fmt: skip
    one = ball | {"verdict": "error", "causes": [], "laws": [], "errors": [], "rows": [row]}
    one |= {"gain": None, "next_measurement": None}
    what, cause, then = first_lines(one)
    assert tells(what, "Line 9", "61.5 mm", "52.25 mm", "15 standard deviations", "90 mm")
    assert tells(cause, "line 9", "120 mm")
    assert "again" in then
    three = [row | {"line": n} for n in (12, 5, 9)]
    assert tells(first_lines(one | {"rows": three})[0], "Lines 5, 9 and 12")
