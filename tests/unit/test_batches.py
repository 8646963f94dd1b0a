"""Batches of short runs: each run is kept, none is done twice, and a failure names the run and
why."""

import json

import pytest

from calibration.batches import run_batch
from calibration.campaign import run_id
from calibration.errors import CalibrationError
from dem.io.files import write_json

DROP = {"experiment": "drop", "geometry": {"drop_height_mm": 5.0, "drops": 1}}


def plan_of(folder, specs):
    write_json(folder / "plan.json", {run_id(s): s for s in specs})
    return folder / "plan.json"


def test_batches_share_the_runs_and_a_second_time_does_none(tmp_path):
    plan = plan_of(tmp_path, [DROP | {"seed": n} for n in range(3)])
    for batch in range(2):
        run_batch(plan, batch, 2, tmp_path / f"{batch}.json", root=tmp_path / "runs")
    done = [json.loads((tmp_path / f"{b}.json").read_text())["runs"] for b in range(2)]
    assert sorted(done[0] + done[1]) == sorted(json.loads(plan.read_text()))
    results = {p: p.stat().st_mtime_ns for p in (tmp_path / "runs").glob("*/result.json")}
    assert len(results) == 3
    run_batch(plan, 0, 1, tmp_path / "again.json", root=tmp_path / "runs")
    assert results == {p: p.stat().st_mtime_ns for p in results}


def test_a_failed_run_is_named_with_its_reason(tmp_path):
    grains = {"particles": {"count": 5, "diameter_mm": 4.0}}
    bad = {"experiment": "heap", **grains, "geometry": {"generation_rate_per_s": 500}}
    plan = plan_of(tmp_path, [bad, DROP])
    with pytest.raises(CalibrationError, match=f"{run_id(bad)}: no heap"):
        run_batch(plan, 0, 1, tmp_path / "done.json", root=tmp_path / "runs")
    assert not (tmp_path / "done.json").exists()
    assert (tmp_path / "runs" / run_id(DROP) / "result.json").exists()
    run_batch(plan, 0, 1, tmp_path / "done.json", "kept", root=tmp_path / "runs")
    assert json.loads((tmp_path / "done.json").read_text())["failed"] == [run_id(bad)]
