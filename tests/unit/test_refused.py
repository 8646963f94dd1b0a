"""A run that cannot be measured: kept without a value, told, and no end of the study."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from calibration import engines
from calibration.chain import responses
from calibration.errors import CalibrationError
from calibration.runs import runner
from calibration.runs.store import RunStore
from calibration.stages.screening import STAGES
from calibration.telling.sentences import sentences_of
from dem.errors import MeasureError, RefusedStateError
from dem.results import run_name, write_result
from dem.spec import parse_spec
from facts import refused, tells

SPEC = {"experiment": "heap", "seed": 1}


def fails(error):
    def make(*_, **__):
        raise error

    return make


@pytest.fixture
def no_points(monkeypatch):
    monkeypatch.setattr(runner, "points_of", lambda *_: ["screening, run 3 of 12"])


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (RefusedStateError("clogged", "the funnel is clogged"), "clogged"),
        (MeasureError("no heap: 5 grains lie on the plate"), "unmeasured"),
    ],
)
def test_a_run_that_cannot_be_measured_is_kept_without_metrics(
    tmp_path, monkeypatch, capsys, no_points, error, kind
):
    monkeypatch.setattr(engines, "make", fails(error))
    said = runner._made(SPEC, tmp_path, None, None)
    result = RunStore(tmp_path.parent).result(tmp_path.name)
    assert result["metrics"] == {}
    assert RunStore(tmp_path.parent).known(tmp_path.name)["refused"]
    assert result["numerics"]["refused"] == {"kind": kind, "reason": str(error)}
    shown = capsys.readouterr().err
    assert f"gives no value: {error}" in shown
    assert tells(shown, "screening", "run 3 of 12")
    assert str(error) in said


@pytest.fixture
def runs(tmp_path, monkeypatch, no_points):
    """Three rows of a design, the last two without a heap."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(engines, "make", fails(MeasureError("no heap: 5 grains lie on the plate")))
    names = []
    for seed in (2, 3):
        spec = SPEC | {"seed": seed}
        names.append(run_name(parse_spec(spec)))
        runner._made(spec, RunStore().folder(names[-1]), None, None)
    return pd.DataFrame(
        {"run": [1, 2, 3], "run_id": ["?", *names], "response": [30.0, np.nan, np.nan]}
    )


def test_what_is_left_out_is_named_with_its_reason(runs):
    rows = responses.left_out(runs)
    assert [row["run"] for row in rows] == [2, 3]
    [said] = responses.without_value(rows)
    assert tells(said, "run 2, 3", "no heap", "5 grains")


def finished(tmp_path, monkeypatch, **notes):
    """A stage's table of three heaps of 30 degrees, with the notes {run: sentence} of some."""
    monkeypatch.chdir(tmp_path)
    names = []
    for number in (1, 2, 3):
        spec = parse_spec(SPEC | {"seed": number})
        names.append(run_name(spec))
        said = {"notes": [notes[f"run{number}"]]} if f"run{number}" in notes else {}
        metrics = {"angle_of_repose_deg": 30.0}
        write_result(RunStore().folder(names[-1]), spec, metrics, said, files=())
    design = pd.DataFrame({"run": [1, 2, 3], "run_id": names})
    return responses.with_responses(design, SimpleNamespace(target="angle_of_repose_deg"))


def test_a_note_of_a_run_is_in_the_stages_table_and_sentences(tmp_path, monkeypatch):
    table = finished(tmp_path, monkeypatch, run2="some grains still spin")
    assert list(table["note"]) == ["", "some grains still spin", ""]
    summary = responses.told(table)
    assert summary["noted"] == [{"run": 2, "note": "some grains still spin"}]
    stage = next(s for s in STAGES if s.name == "screening")
    quiet = replace(stage, sentences=None)
    [said] = sentences_of(quiet, summary, None)
    assert tells(said, "Run 2", "still spin")


def test_a_design_with_too_few_values_says_why(runs):
    with refused(CalibrationError, "1 of 3", "run 2, 3", "5 grains"):
        with responses.naming_left_out(runs):
            responses.with_value(runs)
