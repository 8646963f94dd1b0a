"""What is said of a mechanism whose runs all ended without a value, as tests did."""

import pytest

from diagnosis.catalogue import load_catalogue
from diagnosis.page.first_lines import said as line_of
from diagnosis.rules import with_untried
from facts import tells

FLOW = {"experiment": "discharge", "levers": {"orifice_diameter_mm": 10.4}, "tests": 5, "failed": 5}
LAW = {
    "experiment": "discharge", "slot": "rolling_friction", "state": [], "names": ["rolling_law"],
    "rivals": [],
}  # fmt: skip
CLOGGED = {
    "verdict": "identified", "causes": ["rolling_law"], "laws": [LAW], "outcomes": [FLOW],
    "misfit": {"chi_square": 2.0, "freedom": 4.0, "deviance": 24.1, "p": 0.007},
}  # fmt: skip
BASE = {"experiment": "discharge", "mechanism": "base", "runs": 26, "failed": 8, "error": 0.1}
SILENT = {"experiment": "discharge", "mechanism": "cohesion", "runs": 0, "failed": 6}


def said(verdict, *errors):
    return with_untried(verdict, [BASE, *errors], load_catalogue())


@pytest.mark.parametrize("verdict", ["identified", "discovered", "ambiguous"])
def test_what_ended_all_its_runs_is_not_ruled_out_where_tests_ended_so(verdict):
    causes = [] if verdict == "discovered" else CLOGGED["causes"]
    found = said(CLOGGED | {"verdict": verdict, "causes": causes}, SILENT)
    assert found["verdict"] == "ambiguous"
    assert found["causes"] == ["rolling_law", "cohesion"]
    assert [r["slot"] for r in found["laws"][0]["rivals"]] == ["attraction"]
    assert found["untried"] == [{"experiment": "discharge", "mechanism": "cohesion", "runs": 6}]
    assert tells(line_of("following", found | {"gain": None}), "cohesion", "6")


@pytest.mark.parametrize(
    ("change", "errors"),
    [
        ({}, []),
        # it gave values, and was judged by them
        ({}, [SILENT | {"runs": 9, "error": 0.2}]),
        # what is wrong are the readings, not the tests without one
        ({"misfit": CLOGGED["misfit"] | {"chi_square": 30.0}}, [SILENT]),
        ({"outcomes": [FLOW | {"failed": 0}]}, [SILENT]),
        ({"verdict": "adequate", "causes": [], "laws": []}, [SILENT]),
    ],
)
def test_elsewhere_a_verdict_stays_as_it_is(change, errors):
    before = CLOGGED | change
    found = said(before, *errors)
    assert found == before | {"untried": []}


def test_what_nothing_explains_tells_what_could_not_be_tried():
    found = said(CLOGGED | {"verdict": "unexplained", "causes": [], "laws": []}, SILENT)
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["untried"]
