"""The page's first screen: the block, the sentences and the profiler say what the study's files
say."""

import io
import json
import re
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
import yaml

from browser import browse, find_browser
from calibration.chain.optimum import sentences
from calibration.chain.validation import judged
from calibration.figures import response_of
from calibration.statistics.design import box_behnken
from calibration.statistics.surface import fit_surface
from calibration.statistics.validate import compare
from calibration.study.factors import Factor
from calibration.study.stages import load_stages
from calibration.telling.report import build
from calibration.telling.report.answer import answer
from calibration.telling.report.block import block
from calibration.telling.report.carried import workbook
from calibration.telling.report.findings import findings
from facts import tells
from small_heap import SPEC

ROOT = Path(__file__).parents[2]
ANGLE = response_of("angle_of_repose_deg")
REGION = [Factor(c, f"factor_{c.lower()}", f"k.{c}", 0.0, 2.0) for c in "ABC"]
TARGET = 30.0
SCHEMA = json.loads((ROOT / "src" / "diagnosis" / "verdict.schema.json").read_text())
VERDICTS = SCHEMA["properties"]["verdict"]["enum"]


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))


@pytest.fixture
def study(tmp_path):
    """A study whose response is 30 + 4 a - 2 b c, with a little scatter."""
    folder = tmp_path / "results" / "x"
    runs = box_behnken(REGION)
    scatter = np.random.default_rng(1).normal(0, 0.1, len(runs))
    runs["response"] = TARGET + 4 * runs["A"] - 2 * runs["B"] * runs["C"] + scatter
    write(folder / "response_surface" / "region.json", [vars(f) for f in REGION])
    runs["run_id"] = [f"heap-{k:016x}" for k in range(len(runs))]
    runs.to_csv(folder / "response_surface" / "runs.csv", index=False)
    optimum = {
        "optimum": {f.name: 1.0 for f in REGION},
        "solution_set": {"factor_a": [0.9, 1.1], "factor_b": [0.0, 2.0], "factor_c": [0.0, 2.0]},
        "attainable": True,
        "target": TARGET,
        "predicted": TARGET,
        "rule": "closest_to_centre",
        "confirmation_interval": [29.9, 30.1],
        "confirmation_runs": 5,
    }
    write(folder / "optimise" / "optimum.json", optimum)
    effects = {"factor_a": 8.0, "factor_b": 1.5, "factor_c": -2.5, "factor_d": -3.0}
    write(
        folder / "screening" / "screening.json",
        {"factors": ["factor_a", "factor_b", "factor_c"], "significant": ["factor_a"],
        "alpha": 0.05,
         "effects": effects, "p": dict.fromkeys(effects, 0.01),
         "why": {"factor_c": "the configured path names it"}},
    )  # fmt: skip
    table = pd.DataFrame({"code": list("ABCD"), "name": list(effects), "effect": effects.values()})
    table["contribution_percent"] = [80.0, 3.0, 7.0, 10.0]
    table.to_csv(folder / "screening" / "effects.csv", index=False)
    return folder


def said(study):
    return dict(findings(study, ANGLE))


def test_the_sentences_name_what_decides_what_is_open_and_what_was_preferred(study):
    found = said(study)
    assert tells(found["What decides"], "Factor a", "+8°", "80 %")
    assert tells(found["What stays open"], "factor b", "0 to 2", "factor c")
    assert tells(found["What stays open"], "factor a", "0.9 to 1.1")
    wrong = found["What to know of the runs"]
    assert tells(wrong, "Factor d", "−3°", "not calibrated", "factor b", "+1.5°")
    assert tells(wrong, "factor c", "−2.5°", "configured path")


def test_a_target_that_the_surface_gives_nowhere_bounds_nothing(study):
    """One point comes nearest to it, which is no range of parameters that give it."""
    file = study / "optimise" / "optimum.json"
    optimum = json.loads(file.read_text())
    optimum |= {"attainable": False, "predicted": 29.0, "confirmation_interval": [27.5, 30.5]}
    optimum["solution_set"] = {f.name: [1.0, 1.0] for f in REGION}
    write(file, optimum)
    open_ = said(study)["What stays open"]
    told = " ".join(sentences(optimum, ANGLE))
    for text in (open_, told):
        assert tells(text, f"{TARGET:.2f}°", "29.00°", "27.50°", "30.50°")
        assert "1 to 1" not in text
    assert "bounds no parameter" in open_
    assert not any("solution set" in k for row in answer(study, ANGLE)["parameters"] for k in row)


@pytest.mark.parametrize(("predicted", "green"), [(-0.2, None), (0.9, True)])
def test_nothing_is_green_where_the_surface_predicts_nothing(study, predicted, green):
    validation = {
        "simulated_mean": 30.1, "measured_mean": 30.0, "relative_error_percent": 0.33,
        "simulated_n": 9, "difference": 0.1, "difference_low": -0.2, "difference_high": 0.4,
        "margin": 1.0, "equivalent": True, "equivalence_low": 0.0, "equivalence_high": 0.25,
    }  # fmt: skip
    write(study / "validation" / "validation.json", validation)
    surface = {"statistics": {"R2_pred": predicted}}
    write(study / "response_surface" / "response_surface.json", surface)
    (tile,) = [t for t in answer(study, ANGLE)["tiles"] if t["name"] == "Difference"]
    assert tile["good"] is green
    assert ("predicts little" in tile["text"]) == (green is None)


def test_the_answer_goes_into_a_workbook(study):
    """Another reader finds the values and the citation; the same study makes the same bytes."""
    said = answer(study, ANGLE)
    first = workbook(study.name, said, block(study), [])
    assert first == workbook(study.name, said, block(study), [])
    book = openpyxl.load_workbook(io.BytesIO(first))
    rows = list(book["calibrated"].iter_rows(values_only=True))
    assert rows[0][:2] == ("parameter", "calibrated")
    values = {row["parameter"]: float(row["calibrated"]) for row in said["parameters"]}
    assert {row[0]: row[1] for row in rows[1:]} == values
    assert any("engine" in str(row) for row in book["words"].iter_rows(values_only=True))


@pytest.mark.parametrize("kind", VERDICTS)
def test_every_verdict_begins_the_page_with_its_own_sentences(study, kind):
    """With those of the diagnosis; of a verdict that has none with causes and reason."""
    lines = ["Drops from 250 mm are 7 % low.", "The cause is air."]
    own = {"verdict": kind, "causes": ["air_drag"], "reason": "it passes"}
    for extra, facts in (({"first_lines": lines}, lines), ({}, ["air drag", "it passes"])):
        write(study / "diagnosis" / "verdict.json", own | extra)
        tile = next(t for t in answer(study, ANGLE)["tiles"] if t["value"] == kind)
        assert all(fact in tile["text"] for fact in facts)
        assert tile["good"] == (kind == "adequate")


POSTERIOR = {
    "level": 0.95,
    "parameters": {
        "factor_a": {"interval": [0.8, 1.3], "bounded": True},
        "factor_b": {"interval": [0.05, 1.9], "bounded": False},
    },
    "box": {"factor_a": [0.0, 2.0], "factor_b": [0.0, 2.0]},
    "correlation": [[1.0, 0.1], [0.1, 1.0]],
    "pushed_forward": {"mean": [29.0, 31.0], "run": [28.0, 32.0]},
    "trained_by": 40,
    "sampler": {"converged": True},
    "readings": 5,
    "next_experiment": [
        {
            "metric": "on_plate",
            "meaning": "grains in the heap",
            "measured": True,
            "factor_a left": 0.95,
            "factor_b left": 0.3,
        }
    ],
}


def test_the_answer_is_the_posterior_s_where_it_has_run(study):
    from calibration.telling.report.answer import answer

    optimum = json.loads((study / "optimise" / "optimum.json").read_text())
    optimum["interval_95_others_held"] = {f.name: [0.9, 1.1] for f in REGION}
    write(study / "optimise" / "optimum.json", optimum)
    held = answer(study, ANGLE)["parameters"][0]
    [key] = [k for k in held if k.startswith("95 %")]
    assert "the others" in key
    assert held[key] == "0.9 to 1.1"
    write(study / "posterior" / "posterior.json", POSTERIOR)
    rows = answer(study, ANGLE)["parameters"]
    assert rows[0]["95 %"] == "0.8 to 1.3"
    assert tells(rows[1]["95 %"], "not bounded", "0 to 2")
    assert not any("the others" in heading for heading in rows[0])
    found = said(study)["What stays open"]
    assert tells(found, "95 %", "factor a", "0.8 to 1.3")
    assert tells(found, "factor b", "0 to 2")
    assert tells(found, "5 readings", "on the plate", "30 %", "factor b")


def test_a_difference_that_is_beyond_the_margin_is_called_one(study):
    """Ten heaps that are 13 degrees too flat are no want of proof."""
    found = compare([[22.0, 23.5, 24.1, 25.0, 23.4]], [36.0, 37.0, 38.0], 1.0).as_dict()
    write(study / "validation" / "validation.json", found)
    shown = said(study)["What is wrong"], answer(study, ANGLE)["tiles"][1]["text"]
    for text in (*shown, judged(found, "°")):
        assert tells(text, "different", "more than 1°")
    assert "not shown" not in " ".join(shown)


PACKED = {
    "machine": "bulk", "metric": "poured_density_kg_m3", "mean": 735.1, "low": 717.4, "high": 752.8,
    "measured": 773.0, "within": False,
}  # fmt: skip


@pytest.mark.parametrize("stage", ["push_through", "joint_push_through"])
def test_a_second_experiment_that_is_missed_is_wrong_and_one_that_is_met_is_said(study, stage):
    """A row of the calibrated metric is no second experiment, nor is one without a measured
    value."""
    again = PACKED | {"metric": "angle_of_repose_deg"}
    for measured, within, wrong in ((773.0, False, True), (740.0, True, False)):
        row = PACKED | {"measured": measured, "within": within}
        rows = [row, again, PACKED | {"measured": None, "within": None}]
        write(study / stage / f"{stage}.json", {"metrics": rows})
        text = said(study)["What is wrong"]
        assert text.startswith("Nothing") != wrong
        assert tells(text, "Bulk", f"{measured:g}", "717.4", "752.8")
        assert tells(text, "4.9 %", "missed") == wrong
        assert text.count("Bulk") == 1


def joint(**changes):
    """joint.json of two tests that agree."""
    target = {"rig": "vessel", "metric": "poured_density_kg_m3", "measured": 773.0,
              "predicted": 754.0, "pull": 1.1, "pull_others": 1.8, "p_others": 0.2,
              "agrees": True}  # fmt: skip
    parameters = {"factor_a": {"interval": [0.5, 1.5]}, "factor_b": {"interval": [0.0, 2.0]}}
    agreement = {"p": 0.5, "contradicts": False, "named": []}
    return {"targets": [target], "parameters": parameters, "agreement": agreement} | changes


def test_tests_that_contradict_the_others_are_wrong(study):
    write(study / "joint" / "joint.json", joint())
    assert said(study)["What is wrong"].startswith("Nothing")
    (target,) = joint()["targets"]
    off = target | {"pull_others": 3.4, "p_others": 0.001, "agrees": False}
    write(study / "joint" / "joint.json", joint(targets=[off]))
    assert tells(said(study)["What is wrong"], "Vessel", "773 kg/m³", "+3.4", "0.001")
    apart = {"p": 0.003, "contradicts": True, "named": ["vessel poured density", "heap angle"]}
    write(study / "joint" / "joint.json", joint(agreement=apart))
    assert tells(said(study)["What is wrong"], "vessel poured density", "heap angle")


def test_a_calibrated_value_that_all_tests_leave_out_is_wrong(study):
    """One target gave 1.0 of factor a; all tests together leave 1.2 to 1.5."""
    narrow = {"factor_a": {"interval": [1.2, 1.5]}, "factor_b": {"interval": [0.0, 2.0]}}
    write(study / "joint" / "joint.json", joint(parameters=narrow))
    text = said(study)["What is wrong"]
    assert tells(text, "factor a 1", "1.2 to 1.5")
    assert "factor b" not in text


def test_the_block_has_every_parameter_and_what_was_held_fixed(study):
    entries = {
        "contacts.particle_wall.restitution": {"value": 0.4, "source": "bench test"},
        "contacts.particle_particle.rolling_friction": {
            "value": 0.25, "source": "calibrated", "factor": "factor_a",
            "interval_95_others_held": [0.2, 0.3],
        },
        "materials.particle.shear_modulus_Pa": {"value": 3e6,
        "source": "the configuration's run spec"},
        "laws.rolling": {"value": "constant_torque", "source": "default of the engine"},
        "laws.cohesion": {"value": "none", "source": "default of the engine"},
    }  # fmt: skip
    write(study / "calibrated.yaml", yaml.safe_dump({"parameters": entries}))
    write(study / "exports" / "dem.yaml", yaml.safe_dump(SPEC))
    rows = {(r["where"], r["parameter"]): r for r in block(study)}
    rolling = rows["grain on grain", "rolling friction"]
    assert rolling["value"] == "0.25"
    known = "how it is known"
    assert tells(rolling[known], "calibrated", "95 %", "the others", "0.2 to 0.3")
    assert rows["grain on wall", "restitution"][known] == "bench test"
    assert rows["grain", "shear modulus"]["unit"] == "Pa"
    assert rows["law", "rolling"]["value"] == "constant torque"
    assert ("law", "cohesion") not in rows
    assert float(rows["simulator", "time step"]["value"]) > 0
    write(study / "posterior" / "posterior.json", POSTERIOR)
    rows = {(r["where"], r["parameter"]): r for r in block(study)}
    assert rows["grain on grain", "rolling friction"][known] == "calibrated; 95 %: 0.8 to 1.3"
    build(study, study / "report.html", load_stages())
    assert 'class="cards block"' in (study / "report.html").read_text()


@pytest.mark.skipif(find_browser() is None, reason="no Chromium on this machine")
def test_the_profiler_shows_the_fitted_surface(study, tmp_path):
    """The page's own arithmetic at a point of the reader's choice beside the library's."""
    build(study, study / "report.html", load_stages())
    runs = pd.read_csv(study / "response_surface" / "runs.csv")
    surface = fit_surface(runs, list("ABC"), runs["response"])
    with browse(find_browser(), tmp_path / "browser") as tab:
        for width in (390, 1280):
            tab.open((study / "report.html").as_uri(), width, 844)
            shown = []
            for place, share in ((0, 0.5), (0, 0.9), (2, 0.1)):
                tab.evaluate(
                    f"(() => {{ const i = document.getElementById('lever{place}'); "
                    f"i.value = {1000 * share}; i.dispatchEvent(new Event('input')); }})()"
                )
                shown.append(tab.evaluate("document.querySelector('.profiler output').textContent"))
            assert tab.evaluate("document.documentElement.scrollWidth") <= width
            assert tab.complaints() == []
            point = [[0.8, 0.0, -0.8]]
            mean, (low, high) = (
                surface.predict(point)[0],
                surface.confirmation_interval(point, np.inf),
            )
            numbers = [float(x) for x in re.findall(r"\d+\.?\d*", shown[-1])]
            wanted = [mean, 95, low[0], high[0], TARGET, abs(mean - TARGET)]
            assert numbers == pytest.approx(wanted, rel=1e-3)
            assert "solution set" in shown[0]
            assert "too high" in shown[-1]
            lines = tab.evaluate("document.querySelector('.profiler pre').textContent").splitlines()
            assert lines == ["k.A: 1.8", "k.B: 1", "k.C: 0.2"]
