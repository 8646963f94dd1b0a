"""Rules of a verdict: a mechanism whose runs all ended without a value, as tests did, and a base
model that meets the readings while a check of the simulations fails."""

import pytest

from diagnosis.catalogue import load_catalogue
from diagnosis.page.markdown import first_lines
from diagnosis.page.markdown import said as line_of
from diagnosis.rules import FAR, OF_SIMULATED, by_runs, with_untried
from facts import tells

FLOW = {"experiment": "discharge", "levers": {"orifice_diameter_mm": 10.4}, "tests": 5, "failed": 5}
LAW = {
    "experiment": "discharge", "slot": "rolling_friction", "state": [], "names": ["rolling_law"],
    "rivals": [], "evidence": 9.0, "sentence": "",
}  # fmt: skip
CLOGGED = {
    "verdict": "identified", "causes": ["rolling_law"], "laws": [LAW], "outcomes": [FLOW],
    "misfit": {"chi_square": 2.0, "freedom": 4.0, "deviance": 24.1, "p": 0.007},
    "errors": [], "rows": [], "refinement": {"left": []},
}  # fmt: skip
BASE = {"experiment": "discharge", "mechanism": "base", "runs": 26, "failed": 8, "error": 0.1}
SILENT = {"experiment": "discharge", "mechanism": "cohesion", "runs": 0, "failed": 6}


def said(verdict, *errors):
    return by_runs(with_untried(verdict, [BASE, *errors], load_catalogue()), OF_SIMULATED)


@pytest.mark.parametrize("verdict", ["identified", "discovered", "ambiguous"])
def test_what_ended_all_its_runs_is_not_ruled_out_where_tests_ended_so(verdict):
    causes = [] if verdict == "discovered" else CLOGGED["causes"]
    found = said(CLOGGED | {"verdict": verdict, "causes": causes}, SILENT)
    assert found["verdict"] == "ambiguous"
    assert found["causes"] == ["rolling_law", "cohesion"]
    assert [r["slot"] for r in found["laws"][0]["rivals"]] == ["attraction"]
    assert found["untried"] == [{"experiment": "discharge", "mechanism": "cohesion", "runs": 6}]
    assert tells(line_of("following", found | {"gain": None}), "cohesion", "6")
    assert tells(line_of("cause", found), "cohesion", "not tried")


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


def verdict(error=0.2, change=0.0, uncertain=0.0, said="adequate"):
    """A mapping of verdict.json of heaps whose readings have errors of 0.5 degrees."""
    residual = {"experiment": "heap", "levers": {}, "measured": 30.0, "predicted": 30.0}
    step = {"experiment": "heap", "change": change, "uncertain": uncertain, "error": 0.5}
    row = {"experiment": "heap", "mechanism": "base", "error": error, "enough": error <= 0.3}
    return {
        "verdict": said,
        "reason": "the base model fits within the stated spread",
        "misfit": {"p": 0.5},
        "laws": [],
        "errors": [],
        "rows": [],
        "residuals": [residual | {"standardised": 0.0}],
        "refinement": {"share": 0.3, "left": [row]},
        "emulators": [{"experiment": "heap", "mechanism": "base", "runs": 40}],
        "time_step": [step],
        "calibration": {},
    }


@pytest.mark.parametrize(
    "failed", [{"error": FAR + 0.1}, {"change": -1.6}, {"change": 2.0, "uncertain": 0.2}]
)
def test_a_check_that_fails_takes_adequate_back(failed):
    found = by_runs(verdict(**failed), OF_SIMULATED)
    assert found["verdict"] == "not decided"
    told = " ".join(first_lines(found))
    assert ("more runs" in told) == ("error" in failed)
    assert ("finer step" in told) == ("change" in failed)


PASSED = [{}, {"error": FAR}, {"change": 1.4}, {"change": 2.0, "uncertain": 0.3}]


@pytest.mark.parametrize("passed", [*PASSED, {"error": 9.0, "said": "unexplained"}])
def test_a_check_that_passes_changes_nothing(passed):
    assert by_runs(verdict(**passed), OF_SIMULATED) == verdict(**passed)


def test_the_page_says_how_many_runs_would_tell_more():
    """An error of the emulator falls with the root of its runs: from 0.9 to 0.3 by nine times."""
    assert "320 runs of it more" in " ".join(first_lines(verdict(0.9)))
    assert "No number of runs" in " ".join(first_lines(verdict(0.3)))
