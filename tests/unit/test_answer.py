"""The answer of a study: every measured row beside runs at the parameters that are handed out."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from jsonschema import validate
from scipy import stats

from calibration.chain.study import Study
from calibration.intake.measurements import Measurement
from calibration.stages import answer as stage
from calibration.study.config import overlay
from calibration.telling.answer import words
from calibration.telling.answer.schema import Answer
from made_up import HEAP, answer, made_up
from stage_files import write
from workflow_rules import rules_of

SCHEMA = Path(words.__file__).with_name("answer.schema.json")
KEYS = {
    "bounce": "contacts.particle_wall.restitution",
    "rolling": "contacts.particle_particle.rolling_friction",
}
MEASURED = """experiment,quantity,value,unit,sd,n,drop_height_mm,role,outcome,note
heap,angle_of_repose,30.1,deg,0.8,20,,,,
drop,rebound_height,20.5,mm,1.0,5,150,,,
drop,rebound_height,13.7,mm,0.7,5,100,hold out,,
tilt,sliding_angle,25.0,deg,0.5,5,,,,nobody simulates it
tilt,sliding_angle,,deg,,3,,,did_not_slide,
heap,height,31.0,mm,,,,,,a single reading
"""
PRINTED = 0.421


def config_of(tmp_path, monkeypatch, bounce, measured=MEASURED, tests=None):
    ball = {"experiment": "drop", "sweep": {"levels": [0.3, 0.4, 0.5, 0.6]},
            "run": {"geometry": {"drop_height_mm": 150}}}  # fmt: skip
    tests = {"heap": {"experiment": "heap", "run": HEAP}, "ball": ball} | (tests or {})
    return made_up(
        tmp_path, monkeypatch, KEYS, measured, (0.1, 0.9), fixed={"bounce": bounce},
        supplements=["drop"], tests=tests,
    )  # fmt: skip


def simulated(spec, rng):
    """Metrics of a run: a rebound by its closed form, e^2 of the height, and a heap that is half a
    degree steeper for a tenth of restitution less."""
    bounce = spec["contacts"]["particle_wall"]["restitution"]
    if spec["experiment"] == "drop":
        height = spec["geometry"]["drop_height_mm"]
        return {"rebound_height_mm": height * bounce**2 * (1 + 1e-3 * rng.standard_normal())}
    angle = 30.0 - 5.0 * (bounce - PRINTED) + 0.5 * rng.standard_normal()
    return {"angle_of_repose_deg": angle, "height_mm": angle}


def answered(config):
    """answer.json of a study whose chain has ended, and its folder."""
    study, rng = Study(config), np.random.default_rng(5)
    bounce = config.fixed["bounce"]
    region = [{"code": "B", "name": "rolling", "key": KEYS["rolling"], "low": 0.1, "high": 0.3}]
    kept = {
        "optimise/optimum": {
            "optimum": {"rolling": 0.2}, "region": region, "rule": "closest_to_centre",
            "interval_95_others_held": {"rolling": [0.18, 0.22]}, "target": 30.1,
        },
        "validation/validation": {"equivalent": True},
        "validation/plan": {},
        "drop/drop": {"factor": "bounce", "inverse": 0.3697, "quadratic": [150.0, 0.0, 0.0]},
    }  # fmt: skip
    for name in ("screening", "ascent", "response_surface", "candidate_first", "candidate",
                 "drop", "drop_confirmation"):  # fmt: skip
        kept[f"{name}/plan"] = {}
    for name, content in kept.items():
        write(study.folder / f"{name}.json", content)
    heaps = [simulated({"experiment": "heap", "contacts": {"particle_wall": {"restitution":
             bounce}}}, rng) for _ in range(30)]  # fmt: skip
    runs = pd.DataFrame({"response": [h["angle_of_repose_deg"] for h in heaps]})
    runs.to_csv(study.folder / "validation" / "runs.csv", index=False)
    rules = rules_of(config.model_dump(mode="json"))
    rules["plan_answer"].call(study)
    answer(study.folder / "answer" / "plan.json", simulated, wall_time_s=2.0)
    rules["answer"].call(study)
    return study.summary("answer"), study.folder


def rows_of(found):
    return {(t["test"], t["metric"], *t["setting"].values()): t for t in found["tests"]}


def test_a_row_that_the_parameters_miss_is_named_and_the_change_it_makes_measured(
    tmp_path, monkeypatch
):
    """e = 0.421 bounces to 150 e^2 = 26.6 mm, measured 20.5; the heap is 0.26 degrees steeper with
    the level of the drop."""
    found, _ = answered(config_of(tmp_path, monkeypatch, PRINTED))
    rows = rows_of(found)
    for height, measured, error in ((150, 20.5, 1.0), (100, 13.7, 0.7)):
        row = rows["ball", "rebound_height_mm", height]
        assert row["state"] == "missed"
        assert row["predicted"] == pytest.approx(height * PRINTED**2, rel=0.01)
        pull = (measured - height * PRINTED**2) / (error / np.sqrt(5))
        assert row["pull"] == pytest.approx(pull, rel=0.02)
    assert rows["heap", "angle_of_repose_deg"]["state"] == "met"
    assert rows["heap", "angle_of_repose_deg"]["runs"] == 30
    (instead,) = found["wrong"]["instead"]
    assert (instead["parameter"], instead["handed_out"]) == ("bounce", PRINTED)
    assert instead["found"] == pytest.approx(np.sqrt(20.5 / 150), abs=1e-4)
    low, high = instead["change_95"]
    assert low < instead["change"] < high
    # two half widths: a right interval lies farther off once in ten thousand
    assert abs(instead["change"] - 5.0 * (PRINTED - 0.3697)) < high - low
    assert found["wrong"]["verdict"] == "missed"
    assert len(found["wrong"]["rows"]) == 2


def test_parameters_that_meet_what_was_measured_are_not_blamed(tmp_path, monkeypatch):
    found, _ = answered(config_of(tmp_path, monkeypatch, 0.37))
    states = {key: row["state"] for key, row in rows_of(found).items()}
    assert states["ball", "rebound_height_mm", 150] == "met"
    assert states["ball", "rebound_height_mm", 100] == "met"
    assert found["wrong"]["verdict"] == "met"
    assert (found["wrong"]["rows"], found["wrong"]["instead"]) == ([], [])


@pytest.mark.parametrize(("angle", "state"), [(30.9, "met"), (31.5, "missed")])
def test_a_heap_that_is_off_is_met_within_its_margin_alone(tmp_path, monkeypatch, angle, state):
    """Runs scatter about 30 degrees by 0.5, readings by 0.4 (30 and 20 of them); the margin is 1
    degree."""
    measured = MEASURED.replace("30.1,deg,0.8", f"{angle},deg,0.4")
    found, _ = answered(config_of(tmp_path, monkeypatch, 0.37, measured))
    heap = rows_of(found)["heap", "angle_of_repose_deg"]
    assert (heap["state"], heap["p"] < 0.05) == (state, True)
    assert ("margin of 1 deg" in heap["note"]) == (state == "met")


def test_a_heap_that_its_validation_calls_different_is_missed_beside_other_rows(
    tmp_path, monkeypatch
):
    """Two readings alone: 3.6 degrees are ten of their errors, and p is 0.04."""
    config = config_of(tmp_path, monkeypatch, 0.37)
    row, values = Measurement("heap", 30.18, 0.51, 2, {}), np.linspace(26.0, 27.2, 10)
    test = stage._row(row, "heap", "angle_of_repose_deg", values, "")
    judged = stage._judged(config, test, count=2)
    assert 0.025 < judged.p < 0.05
    assert judged.state == "missed"


def test_every_measured_row_stands_in_the_answer(tmp_path, monkeypatch):
    """Also one that no test simulates, and one that nobody gives an error of."""
    found, folder = answered(config_of(tmp_path, monkeypatch, 0.37))
    rows = rows_of(found)
    tilts = [t for t in found["tests"] if t["test"] == "tilt"]
    assert [t["measured"] for t in tilts] == [25.0, None]
    assert {t["state"] for t in tilts} == {"not simulated"}
    assert "did not slide" in tilts[1]["note"]
    assert rows["heap", "height_mm"]["state"] == "not judged"
    assert rows["heap", "height_mm"]["predicted"] is not None
    assert len(pd.read_csv(folder / "answer" / "tests.csv")) == 6
    drawn = (folder / "answer" / "pulls.svg").read_text()
    assert "rebound height at drop height 150 mm" in drawn
    assert found["runs"] == {"made": 12, "failed": 0, "seconds": 24.0}
    validate(found, json.loads(SCHEMA.read_text("utf-8")))
    assert Answer.model_validate(found).model_dump(mode="json") == found
    by_key = {p["key"]: p for p in found["parameters"]}
    assert by_key[KEYS["rolling"]]["interval_95"] == [0.18, 0.22]
    assert by_key[KEYS["rolling"]]["source"] == "calibrated"
    assert by_key[KEYS["bounce"]]["source"] == "fixed"


def test_another_test_of_the_experiment_is_simulated_and_not_taken_for_the_validated_heap(
    tmp_path, monkeypatch
):
    """Grains of 3 mm, where the study's own have 2 mm."""
    head, *rows = MEASURED.splitlines()
    other = "heap,angle_of_repose,30.4,deg,0.8,20,,,,,3.0"
    lines = [f"{head},particle_diameter_mm", *(f"{row}," for row in rows), other]
    run = overlay(HEAP, {"particles": {"diameter_mm": 3.0}})
    large = {"large": {"experiment": "heap", "run": run}}
    found, _ = answered(config_of(tmp_path, monkeypatch, 0.37, "\n".join(lines) + "\n", large))
    heaps = {t["measured"]: t for t in found["tests"] if t["metric"] == "angle_of_repose_deg"}
    assert (heaps[30.1]["runs"], heaps[30.4]["runs"]) == (30, stage.RUNS)


def test_the_kept_schema_is_that_of_the_code():
    assert json.loads(SCHEMA.read_text("utf-8")) == Answer.model_json_schema()


@pytest.mark.slow
def test_right_parameters_are_blamed_as_often_as_stated(tmp_path, monkeypatch):
    """Of studies whose seven rows the model meets, one row or more is missed in 5 %."""
    config, rng = config_of(tmp_path, monkeypatch, 0.37), np.random.default_rng(1)
    blamed, studies, count = 0, 1000, 7
    for _ in range(studies):
        tests = []
        for _ in range(count):
            sd, n = 1.0, int(rng.integers(3, 12))
            readings = rng.normal(10.0, sd, n)
            row = Measurement("drop", readings.mean(), readings.std(ddof=1), n, {})
            values = rng.normal(10.0, 0.5, stage.RUNS)
            tests.append(stage._row(row, "drop", "rebound_height_mm", values, ""))
        blamed += any(stage._judged(config, t, count).state == "missed" for t in tests)
    assert stats.binomtest(blamed, studies, stage.ALPHA).pvalue > 1e-3 or blamed < 0.05 * studies


def test_the_terminal_says_what_the_file_says(tmp_path, monkeypatch):
    found, _ = answered(config_of(tmp_path, monkeypatch, PRINTED))
    said = str(Answer.model_validate(found))
    for test in found["tests"]:
        assert words.MARKS[test["state"]] in said
    assert "0.18 to 0.22" in said
    assert "20.5" in said
    assert found["wrong"]["sentence"] in said
