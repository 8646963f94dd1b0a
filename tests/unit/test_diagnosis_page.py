"""The diagnosis stands alone: a page of its own in plain words, and names that are withdrawn."""

import json
import math
import re

import pytest

from calibration.figures import parameter_words
from calibration.telling.report.plain import write_page
from diagnosis.laws.in_engine import not_run
from diagnosis.page.first_lines import first_lines
from diagnosis.page.markdown import page
from diagnosis.page.words import odds
from diagnosis.withdrawal import FIT, withdraw_refuted
from facts import tells
from frozen import FROZEN

REFERENCE = FROZEN / "table-tennis-ball"


@pytest.fixture
def ball():
    """The recorded verdict of a ball on a floor, with the words that a new one has."""
    verdict = json.loads((REFERENCE / "verdict.json").read_text())
    for part in ("calibration", "calibration_extended"):
        for entry in verdict[part].values():
            entry["words"] = parameter_words("contacts.particle_wall.restitution")
    verdict["moved"] = {}
    return verdict


def missing_by(verdict, miss):
    return verdict | {"gain": verdict["gain"] | {"held_out_rmse_after_all_errors": miss}}


def test_a_named_cause_that_the_engine_does_not_confirm_is_only_the_best_of_those_tried(ball):
    found = withdraw_refuted(missing_by(ball, 5.13))
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["best_tried"] == ["air_drag"]
    text = page(found)
    assert "air drag" in text.splitlines()[2]
    assert "5.1 standard errors" in text


@pytest.mark.parametrize("miss", [0.0, 1.23, FIT])
def test_a_cause_that_fits_in_the_engine_stays_named(ball, miss):
    assert withdraw_refuted(missing_by(ball, miss))["causes"] == ["air_drag"]


def test_settings_that_gave_no_value_are_told(ball):
    assert "gives no value" not in page(ball)
    lost = ball | {"gain": ball["gain"] | {"without_value": 3}}
    assert tells(page(lost), "3 more", "no value")


def test_a_model_that_gives_no_value_anywhere_is_not_confirmed(ball):
    found = withdraw_refuted(ball | {"gain": None, "extended_with": ["air_drag"]})
    assert found["verdict"] == "unexplained"
    assert tells(found["reason"], "no value")


@pytest.mark.parametrize(
    ("gain", "text"),
    [
        (0.0, "1 to 1"),
        (2.0, "7.4 to 1"),
        (math.log(400.0), "400 to 1"),
        (22.8, "more than 1,000 to 1"),
    ],
)
def test_a_gain_is_told_as_odds_that_a_person_can_use(gain, text):
    assert odds(gain) == text


def law(**more):
    """A law as verdict.json has it."""
    own = {"experiment": "drop", "slot": "restitution", "state": ["speed"], "names": [],
           "forms": [], "values": [], "unit": "1", "gain": None, "rivals": [],
           "sentence": "The restitution falls from 0.95 to 0.90."}  # fmt: skip
    return own | more


MISFIT = {"chi_square": 20.0, "freedom": 19.0, "p": 0.4}


def test_the_first_sentence_says_what_is_wrong_by_how_much_and_where(ball):
    """Of four settings whose rebound is 10 % too low at 200 mm and met elsewhere."""
    rows = [
        {"experiment": "drop", "levers": {"drop_height_mm": h}, "measured": m, "predicted": 100.0,
         "sd": 1.0, "standardised": m - 100.0, "predictive_p": 0.5}
        for h, m in [(50.0, 100.0), (100.0, 100.0), (200.0, 90.0), (400.0, 100.0)]
    ]  # fmt: skip
    what, cause, cost = first_lines(ball | {"residuals": rows})
    assert "rebound" in what
    assert "5 %" in what  # the root of a quarter of 10 % squared
    assert tells(what, "drop height", "200 mm")
    assert "10 % above the readings" in what
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
        ("ambiguous", {"causes": ["air_drag", "wall_adhesion"]}, "or wall adhesion"),
        ("ambiguous", {"causes": [], "laws": [law(rivals=[{"words": "a zero off"}])]},
         "a zero off"),
        ("error", {"causes": [], "errors": [{"experiment": "drop", "of": "drop_height_mm",
         "sd": 0.1, "p": 0.01, "rivals": [], "sentence": "Line 9 reads like 132 mm."}]}, "132 mm"),
        ("error", {"causes": [], "errors": [], "rows": [{"line": 9, "standard_deviations": 15.0,
         "sentence": "Line 9 lies off."}]}, "line 9"),
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


def test_scatter_from_setting_to_setting_is_told_with_its_size_first(ball):
    error = {"experiment": "drop", "of": "settings", "what": "settings", "sd": 0.051, "p": 1e-3,
             "rivals": [], "sentence": "scatter"}  # fmt: skip
    changed = {"verdict": "error", "causes": [], "laws": [], "rows": [], "errors": [error]}
    first, second, third = first_lines(ball | changed | {"gain": None, "next_measurement": None})
    assert tells(first, "rebound", "setting", "5.1 %")
    assert tells(second, "law", "row", "setting")
    assert "again" in third


def residual(experiment, levers, off):
    """A row of `residuals`: 100 is predicted."""
    return {"experiment": experiment, "levers": levers, "measured": 100.0 + off, "sd": 1.0,
            "predicted": 100.0, "standardised": off, "predictive_p": 0.5}  # fmt: skip


def test_every_experiment_in_which_something_is_found_is_told(ball):
    rows = [residual("drop", {"drop_height_mm": h}, off) for h, off in [(50.0, 9.0), (90.0, 0.0)]]
    rows += [residual("tilt", {"tilt_rate_deg_s": r}, off) for r, off in [(2.0, 0.0), (9.0, -4.0)]]
    hand = law(experiment="tilt", slot="reading", state=["rate"], evidence=9.0,
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


@pytest.mark.parametrize(
    ("error", "told"),
    [
        ({"of": "drop_height_mm", "what": "one level", "level": 130.0}, "130 mm"),
        ({"of": "drop_height_mm", "what": "levels", "offsets": {"50": 0.02, "90": -0.05}}, "90 mm"),
        ({"of": "drop_height_mm", "what": "zero"}, "drop height"),
        ({"of": "order", "what": ""}, "first rows"),
        ({"of": "resolution", "what": "", "step": 5.0}, "5 mm"),
    ],
)
def test_an_error_of_the_set_up_says_what_shows_it(ball, error, told):
    own = {"experiment": "drop", "sd": 0.05, "p": 0.001, "evidence": 9.0, "rivals": []}
    own |= {"sentence": "It is off."}
    more = {"verdict": "error", "causes": [], "laws": [], "rows": [], "errors": [own | error]}
    assert told in first_lines(ball | more | {"gain": None, "next_measurement": None})[2]


def test_what_is_not_told_apart_is_told_with_odds(ball):
    near = [{"words": "a wrong zero", "behind": 2.0, "of": "drop_height_mm", "what": "zero"},
            {"words": "an error of each height", "behind": 0.1, "of": "drop_height_mm"},
            {"words": "the same law", "behind": 0.1, "slot": "reading", "state": []}]  # fmt: skip
    same = [{"slot": "reading", "state": []}]
    own = law(evidence=20.0, rivals=near, same=same, names=["plastic_restitution"])
    cause = first_lines(ball | {"verdict": "ambiguous", "causes": [], "laws": [own]})[1]
    assert tells(cause, "plastic restitution", "falls from 0.95 to 0.90", "7.4 to 1", "as likely")
    assert "the same law" not in cause


def test_a_wrong_zero_of_reading_or_lever_asks_for_a_length_that_is_known(ball):
    zero = {"words": "a wrong zero", "behind": 0.1, "of": "drop_height_mm", "what": "zero"}
    own = law(slot="reading", state=[], evidence=9.0, rivals=[zero])
    more = {"verdict": "ambiguous", "causes": [], "laws": [own], "gain": None}
    assert "known" in first_lines(ball | more)[2]
    level = {"words": "an error of each height", "behind": 0.1, "what": "levels"}
    more["laws"] = [own | {"rivals": [zero, level]}]
    assert "known" not in first_lines(ball | more)[2]


def test_a_law_that_left_out_levels_refute_is_told_so(ball):
    gain = ball["gain"] | {"held_out_rmse_before": 11.3, "held_out_rmse_after": 11.5}
    more = {"verdict": "discovered", "causes": [], "laws": [law(evidence=9.0)], "gain": gain}
    assert tells(first_lines(ball | more)[2], "nothing beyond", "11.5", "11.3")


def test_an_adequate_table_says_what_it_leaves_open(ball):
    row = {"slot": "restitution", "state": ["speed"], "unit": "share", "below": -0.04,
           "above": 0.03, "of": "change over the plan's states"}  # fmt: skip
    more = {"verdict": "adequate", "causes": [], "exclusion": [row]}
    assert tells(first_lines(ball | more)[2], "restitution over speed", "-4 %", "+3 %")


HEAPS = {
    "verdict": "adequate", "causes": [], "family_p": 0.3, "emulators": [{"experiment": "heap"}],
    "next_measurement": {
        "experiment": "heap", "levers": {"particle_diameter_mm": 3.6}, "information_bits": 0.1,
        "predictions": {"base": {"value": 37.0, "sd": 1.0}, "cohesion": {"value": 40.5, "sd": 1.0}},
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("p", "gain", "told"), [(0.08, 0.9, True), (0.3, 0.9, False), (0.08, -1, False)]
)
def test_heaps_that_a_mechanism_meets_better_ask_for_the_setting_that_shows_it(ball, p, gain, told):
    """Where chance does as well in 8 %, though not where it does in 30 %."""
    ranking = [{"mechanism": "cohesion", "gain": gain}]
    own = HEAPS | {"ranking": ranking, "lack_of_fit": ball["lack_of_fit"] | {"p": p}}
    lines = first_lines(ball | own | {"misfit": ball["lack_of_fit"], "exclusion": []})
    assert len(lines) == 2 + told
    if told:
        assert tells(lines[2], "cohesion", "8 %", "3.6 mm", "40.5", "37")


@pytest.mark.parametrize("at_an_end", [False, True])
@pytest.mark.parametrize("rough", [False, True])
def test_heaps_that_are_met_tell_what_may_hide_a_law(ball, rough, at_an_end):
    """Runs that are fewer than the readings ask for, and a coefficient that makes up for it."""
    left = [
        {"experiment": "heap", "mechanism": "base", "error": 2.6, "enough": not rough},
        {"experiment": "heap", "mechanism": "cohesion", "error": 5.2, "enough": False},
    ]
    rolling = next(iter(ball["calibration"]))
    calibration = {k: v | {"at_bound": False} for k, v in ball["calibration"].items()}
    calibration[rolling] |= {"at_bound": at_an_end, "words": "rolling friction"}
    own = {"calibration": calibration, "refinement": {"left": left}, "exclusion": []}
    lines = first_lines(ball | HEAPS | own | {"ranking": [], "misfit": ball["lack_of_fit"]})
    assert len(lines) == 2 + (rough or at_an_end)
    last = lines[2] if lines[2:] else ""
    assert tells(last, "2.6", "angle of repose", "runs") == rough
    assert tells(last, "rolling friction", "range") == at_an_end
    assert "5.2" not in last


def test_tests_without_a_value_come_first_where_they_are_off_most(ball):
    outcome = {"experiment": "heap", "levers": {"particle_diameter_mm": 7.0}, "tests": 3}
    outcome |= {"failed": 2, "before": 0.01, "after": None}
    more = {"verdict": "unexplained", "causes": [], "outcomes": [outcome]}
    off = first_lines(ball | more | {"misfit": MISFIT | {"deviance": 30.0}})[0]
    assert "2 of 3 tests" in off
    assert "grain diameter 7 mm" in off
    assert "1 %" in off
    assert "rebound" in first_lines(ball | more | {"misfit": MISFIT | {"deviance": 3.0}})[0]


def test_an_open_verdict_asks_for_a_measurement_and_an_adequate_one_for_none(ball):
    open_ = ball | {"verdict": "unexplained", "causes": []}
    assert "25 mm" in first_lines(open_)[-1]
    assert len(first_lines(ball | {"verdict": "adequate", "causes": []})) == 2


def test_the_page_is_one_file_in_plain_words_with_its_own_names(ball, tmp_path):
    out = tmp_path / "diagnosis.html"
    write_page("Diagnosis", page(ball), REFERENCE, out)
    html = out.read_text()
    text = re.sub(
        r"\s+", " ", re.sub(r"<style.*?</style>|<svg.*?</svg>|<[^>]+>", " ", html, flags=re.S)
    )
    assert "salt" not in text
    assert tells(text, "restitution", "grain on wall")
    assert tells(text, "Verdict", "identified", "air drag")
    assert "more than 1,000 to 1" in text
    assert html.count('<svg role="img"') == 3  # residuals, ranking and gain
    tables = [line for line in page(ball).splitlines() if line.startswith("|---")]
    assert html.count("<table") == len(tables) == 2
    assert not re.search(r"(src|href|url\()=?.https?:", html.replace("xlink:href", "href"))
    assert "|" not in text
    assert "**" not in text


def test_a_law_that_the_engine_lacks_is_told_without_runs(ball):
    law = {
        "experiment": "drop", "slot": "reading", "state": [], "values": [], "names": [],
        "forms": [], "rivals": [], "sentence": "The reading adds 3 mm.",
    }  # fmt: skip
    told = not_run(law)
    assert tells(told, "engine", "no law", "reading")
    assert told in page(ball | {"laws": [law | {"engine": None, "not_run": told}]})
    assert told not in page(ball | {"laws": [law]})
