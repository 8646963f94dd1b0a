"""A base model that meets the readings is not called adequate where a check of the simulations
fails."""

import pytest

from diagnosis.page.first_lines import first_lines
from diagnosis.rules import FAR, undecided


def verdict(error=0.2, change=0.0, uncertain=0.0, said="adequate"):
    """A mapping of verdict.json of heaps whose readings have errors of 0.5 degrees."""
    residual = {"experiment": "heap", "levers": {}, "measured": 30.0, "predicted": 30.0}
    step = {"experiment": "heap", "change": change, "uncertain": uncertain, "error": 0.5}
    row = {"experiment": "heap", "mechanism": "base", "error": error, "enough": error <= 0.3}
    return {
        "verdict": said,
        "reason": "the base model fits within the stated spread",
        "lack_of_fit": {"p": 0.5},
        "residuals": [residual | {"standardised": 0.0}],
        "refinement": {"share": 0.3, "left": [row]},
        "emulators": [{"experiment": "heap", "mechanism": "base", "runs": 40}],
        "time_step": [step],
        "calibration": {},
    }


@pytest.mark.parametrize(
    "failed",
    [{"error": FAR + 0.1}, {"change": -1.6}, {"change": 2.0, "uncertain": 0.2}],
)
def test_a_check_that_fails_takes_adequate_back(failed):
    found = undecided(verdict(**failed))
    assert found["verdict"] == "not decided"
    told = " ".join(first_lines(found))
    assert ("more runs" in told) == ("error" in failed)
    assert ("finer step" in told) == ("change" in failed)


@pytest.mark.parametrize(
    "passed",
    [{}, {"error": FAR}, {"change": 1.4}, {"change": 2.0, "uncertain": 0.3}],
)
def test_a_check_that_passes_changes_nothing(passed):
    assert undecided(verdict(**passed)) == verdict(**passed)


def test_what_is_called_wrong_is_not_taken_back():
    assert undecided(verdict(9.0, said="unexplained"))["verdict"] == "unexplained"


def test_the_page_says_how_many_runs_would_tell_more():
    """An error of the emulator falls with the root of its runs: from 0.9 to 0.3 by nine times."""
    assert "320 runs of it more" in " ".join(first_lines(verdict(0.9)))
    assert "No number of runs" in " ".join(first_lines(verdict(0.3)))
