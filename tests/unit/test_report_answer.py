"""The page's first screen: the block, the sentences and the profiler say what the study's files
say."""

import io
import re

import numpy as np
import openpyxl
import pandas as pd
import pytest
from scipy.optimize import minimize

from answers import ANSWER
from calibration.figures import response_of
from calibration.statistics.design import box_behnken
from calibration.statistics.surface import fit_surface
from calibration.study.factors import Factor
from calibration.study.stage import load_stages
from calibration.telling.report.answer import answer, findings, profiler, workbook
from calibration.telling.report.build import build
from dem.advice import limits_of
from dem.spec import parse_spec
from facts import tells
from stage_files import write

ANGLE = response_of("angle_of_repose_deg")
REGION = [Factor(c, f"factor_{c.lower()}", f"k.{c}", 0.0, 2.0) for c in "ABC"]
TARGET = 30.0


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


def test_the_sentences_name_what_decides_and_what_was_preferred(study):
    found = said(study)
    assert tells(found["What decides"], "Factor a", "+8°", "80 %")
    wrong = found["What to know of the runs"]
    assert tells(wrong, "Factor d", "−3°", "not calibrated", "factor b", "+1.5°")
    assert tells(wrong, "factor c", "−2.5°", "configured path")


def test_odd_points_are_said(study):
    surface = {
        "statistics": {"R2_pred": -0.2, "lack_of_fit_p": 0.01},
        "outliers": [{"run": 7, "studentised": 7.7}],
        "outlier_limit": 4.6,
    }
    write(study / "response_surface" / "response_surface.json", surface)
    runs = said(study)["What to know of the runs"]
    assert tells(runs, "Run 7", "7.7", "4.6")
    assert tells(runs, "lack of fit", "0.01")
    assert "predicted R² -0.20" in runs


def test_the_first_screen_says_parameters_tests_what_is_wrong_and_what_is_next(study):
    """In this order, and as answer.json has it."""
    write(study / "answer" / "answer.json", ANSWER.model_dump(mode="json"))
    assert build(study, study / "report.html", load_stages()) is not None
    page = (study / "report.html").read_text()
    page = page[page.index('id="answer"') :]
    facts = ("1.038", "0.8 to 1.3", "0.54 J/m²", "not bounded", "20.5 mm ± 0.45 mm", "26.6 mm",
             "−13.6", "missed", "35.80° ± 0.2°", "met", "The drop is missed.",
             "leave 30 % of the spread of factor b", "0.421", "published")  # fmt: skip
    at = [page.index(fact) for fact in facts]
    assert at[:4] == sorted(at[:4])
    firsts = [page.index(f) for f in ("1.038", "20.5 mm", "The drop is missed.", "leave 30 %")]
    assert firsts == sorted(firsts)


def test_the_answer_goes_into_a_workbook(study):
    """Another reader finds the values and the citation; the same study makes the same bytes."""
    write(study / "answer" / "answer.json", ANSWER.model_dump(mode="json"))
    said = answer(study, ANGLE)
    first = workbook(study.name, said, [])
    assert first == workbook(study.name, said, [])
    book = openpyxl.load_workbook(io.BytesIO(first))
    head, *rows = book["parameters"].iter_rows(values_only=True)
    assert {row[head.index("value")] for row in rows} >= {1.038, 0.421}
    assert any("engine" in str(row) for row in book["words"].iter_rows(values_only=True))


def test_a_name_cannot_leave_the_profilers_script(study):
    region = [vars(f) | {"name": "</script><b>"} for f in REGION]
    write(study / "response_surface" / "region.json", region)
    point = {"target": TARGET, "optimum": {region[0]["name"]: 1.0}}
    write(study / "optimise" / "optimum.json", point)
    assert "<" not in profiler(study, ANGLE)


def surface_of(study):
    runs = pd.read_csv(study / "response_surface" / "runs.csv")
    return fit_surface(runs, list("ABC"), runs["response"])


def slide(tab, place, share):
    tab.evaluate(
        f"(() => {{ const i = document.getElementById('lever{place}'); "
        f"i.value = {1000 * share}; i.dispatchEvent(new Event('input')); }})()"
    )


def type_value(tab, place, value):
    tab.evaluate(
        f"(() => {{ const i = document.querySelectorAll('.exact')[{place}]; i.value = {value};"
        " i.dispatchEvent(new Event('change')); })()"
    )


def test_the_profiler_shows_the_fitted_surface(study, tab):
    """The page's own arithmetic at a point of the reader's choice beside the library's."""
    build(study, study / "report.html", load_stages())
    surface = surface_of(study)
    for width in (390, 1280):
        tab.open((study / "report.html").as_uri(), width, 844)
        shown = []
        for place, share in ((0, 0.5), (0, 0.9), (2, 0.1)):
            slide(tab, place, share)
            shown.append(tab.evaluate("document.querySelector('.profiler output').textContent"))
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        assert tab.complaints() == []
        point = [[0.8, 0.0, -0.8]]
        [mean], (low, high) = surface.predict(point), surface.confirmation_interval(point, np.inf)
        numbers = [float(x) for x in re.findall(r"\d+\.?\d*", shown[-1])]
        wanted = [mean, 95, low[0], high[0], TARGET, abs(mean - TARGET)]
        assert numbers == pytest.approx(wanted, rel=1e-3)
        assert "solution set" in shown[0]
        assert "too high" in shown[-1]
        lines = tab.evaluate("document.querySelector('.profiler pre').textContent").splitlines()
        assert lines == ["k.A: 1.8", "k.B: 1", "k.C: 0.2"]


POINT = "document.querySelector('.profiler pre').textContent"
DISTANCE = "document.querySelector('.profiler .distance').textContent"


def test_the_distance_to_the_solution_set_is_the_shortest(study, tab):
    build(study, study / "report.html", load_stages())
    surface = surface_of(study)

    def shortest(start, free):
        """Distance in ranges to the set by a general optimiser."""
        bounds = [(-1, 1) if k in free else (start[k], start[k]) for k in range(3)]
        on = {"type": "eq", "fun": lambda z: surface.predict([z])[0] - TARGET}
        found = minimize(
            lambda z: ((z - start) ** 2).sum(), start, bounds=bounds, constraints=on, method="SLSQP"
        )
        assert found.success
        return np.sqrt(found.fun) / 2

    tab.open((study / "report.html").as_uri(), 390, 844)
    for place, share in enumerate((0.9, 0.7, 0.3)):
        slide(tab, place, share)
    start = np.array([0.8, 0.4, -0.4])
    told = float(re.search(r"(\d\S*) of the ranges", tab.evaluate(DISTANCE))[1])
    assert told == pytest.approx(shortest(start, (0, 1, 2)), rel=0.01)
    type_value(tab, 2, 0.6)  # held from now on
    told = float(re.search(r"staying: (\d\S*) of the ranges", tab.evaluate(DISTANCE))[1])
    assert told == pytest.approx(shortest(start, (0, 1)), rel=0.01)
    tab.evaluate("document.querySelector('.profiler .onto').click()")
    assert "solution set" in tab.evaluate("document.querySelector('.profiler output').textContent")
    assert tab.evaluate(POINT).splitlines()[2] == "k.C: 0.6"


@pytest.mark.parametrize(
    ("laws", "mu_r", "limited"),
    [
        ({"rolling": "constant_torque"}, 0.2, True),
        ({"rolling": "constant_torque"}, 0.0, False),
        ({"rolling": "constant_torque_relative"}, 0.2, False),
        ({"rolling": "elastic_plastic", "torsion": "marshall"}, 0.2, False),
    ],
)
def test_the_own_spin_torque_holds_at_rest_alone(tmp_path, laws, mu_r, limited):
    pair = f"{{restitution: 0.5, static_friction: 0.5, rolling_friction: {mu_r}}}"
    chosen = ", ".join(f"{k}: {v}" for k, v in laws.items())
    text = (
        f"experiment: heap\nlaws: {{{chosen}}}\n"
        f"contacts: {{particle_particle: {pair}, particle_wall: {pair}}}\n"
    )
    (tmp_path / "exports").mkdir()
    (tmp_path / "exports" / "dem.yaml").write_text(text)
    (tmp_path / "answer").mkdir()
    (tmp_path / "answer" / "answer.json").write_text(ANSWER.model_dump_json())
    notes = answer(tmp_path, response_of("angle_of_repose_deg"))["notes"]
    assert any(tells(n, "constant_torque", "drum") for n in notes) == limited
    spec = {"experiment": "heap", "laws": laws}
    spec["contacts"] = {"particle_particle": {"rolling_friction": mu_r}}
    assert bool(limits_of(parse_spec(spec))) == limited
