"""A heap that its state refuses: kept without an angle, told, and no end of the study."""

import pytest

from calibration import engines, runner
from calibration.store import RunStore
from dem.errors import MeasureError, RefusedStateError

SPEC = {"experiment": "heap", "seed": 1}


def fails(error):
    def make(*_, **__):
        raise error

    return make


def test_a_refused_heap_is_kept_without_metrics(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        engines, "make", fails(RefusedStateError("clogged", "the funnel is clogged"))
    )
    result = runner._made(SPEC, tmp_path, None)
    assert result["metrics"] == {}
    assert result["numerics"]["refused"]["kind"] == "clogged"
    assert "the funnel is clogged" in capsys.readouterr().err
    assert RunStore(tmp_path.parent).result(tmp_path.name) == result


def test_any_other_failure_stays_one(tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "make", fails(MeasureError("no heap")))
    with pytest.raises(MeasureError):
        runner._made(SPEC, tmp_path, None)
