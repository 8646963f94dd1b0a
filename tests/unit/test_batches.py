"""Batches of short runs: each run is kept, none is done twice, and a failure names the run and
why."""

import json
from pathlib import Path

import pytest
import yaml

from calibration import engines
from calibration.runs.plans import run_id
from calibration.runs.runner import batch_count, batch_of, run_batch
from calibration.runs.store import RunStore
from calibration.runs.verify import lost_runs
from calibration.study.config import parse_config
from calibration.study.cost import LEAST_JOBS, RUN_S, run_seconds
from dem.errors import BlowUpError, StoppedError
from dem.io.files import write_json
from facts import ROOT

DROP = {"experiment": "drop", "geometry": {"drop_height_mm": 5.0, "drops": 1}}


def plan_of(folder, specs):
    write_json(folder / "plan.json", {run_id(s): s for s in specs})
    return folder / "plan.json"


HEAP = {
    "experiment": "heap",
    "particles": {"count": 1250, "diameter_mm": 4.0},
    "geometry": {"generation_rate_per_s": 1250, "orifice_diameter_mm": 28},
}
DRUM = {"experiment": "drum"}
FULL = {"experiment": "heap", "geometry": {"generation_rate_per_s": 1000}}


def many(spec, count):
    return {str(n): spec | {"seed": n} for n in range(count)}


@pytest.mark.parametrize(
    "specs",
    [many(HEAP, 2 * LEAST_JOBS - 1), many(FULL, 10_000), many(DRUM, 10_000), {}],
    ids=["few", "minutes a run", "of unknown cost", "none"],
)
def test_a_run_is_a_job_of_its_own(specs):
    assert batch_count(specs) is None


SMALLEST = yaml.safe_load((ROOT / ".test/config/config.yaml").read_text())
SMALLEST_DROP = SMALLEST["run"] | {"experiment": "drop"}


def test_a_plan_of_heaps_and_drops_is_parted_by_what_all_of_them_cost():
    """Two hundred drops beside sixteen heaps: neither the first run nor the last decides."""
    drops, heaps = many(SMALLEST_DROP, 200), many(FULL, 16)
    heaps = {f"heap {n}": spec for n, spec in heaps.items()}
    jobs = batch_count(drops | heaps), batch_count(heaps | drops)
    assert jobs[0] == jobs[1] > batch_count(drops)
    assert batch_count(drops | {"unknown": DRUM}) is None


LIFTED = {
    "experiment": "lifted_cylinder",
    "particles": {"count": 340, "diameter_mm": 10.0},
    "geometry": {
        "cylinder_diameter_mm": 62.4, "plate_diameter_mm": 278, "lift_speed_mm_s": 20.0,
    },
}  # fmt: skip


def test_a_lift_lasts_as_its_speed_says():
    """340 grains of 10 mm at 0.6 are 97 mm deep: 5.8 s of lift at 20 mm/s, with 1.5 s beside."""
    slow = run_seconds(LIFTED)
    fast = run_seconds(LIFTED | {"geometry": LIFTED["geometry"] | {"lift_speed_mm_s": 2000.0}})
    assert (slow - RUN_S) / (fast - RUN_S) == pytest.approx((5.83 + 1.54) / (0.06 + 1.54), rel=0.01)


def test_the_configuration_may_say_how_many_runs_share_a_process():
    assert batch_count(many(DROP, 10), 4) == 3
    assert batch_count(many(HEAP, 10_000), 1) is None


@pytest.fixture
def study(with_data):
    """A screening of three drops, one of which cannot be made: settings and {name: spec}."""
    config = parse_config(yaml.safe_load((ROOT / "config/config.yaml").read_text()))
    specs = {run_id(s): s for s in (DROP | {"seed": n} for n in range(3))}
    plan_of(with_data / "results" / config.name / "screening", specs.values())
    return config, specs


def made(config, batch, batches, done="done.json", **kept):
    """Make a share of the study's screening."""
    plan = f"results/{config.name}/screening/plan.json"
    run_batch(plan, batch, batches, done, "batch.log", config.model_dump(mode="json"), **kept)


def test_batches_share_the_runs_and_a_second_time_does_none(study):
    config, specs = study
    for batch in range(2):
        made(config, batch, 2, f"{batch}.json")
    done = [json.loads(Path(f"{b}.json").read_text())["runs"] for b in range(2)]
    assert sorted(done[0] + done[1]) == sorted(specs)
    results = {p: p.stat().st_mtime_ns for p in Path("results/runs").glob("*/result.json")}
    assert len(results) == 3
    made(config, 0, 1)
    assert results == {p: p.stat().st_mtime_ns for p in results}


def test_a_drop_in_a_shared_process_gives_what_it_gives_alone(study):
    config, specs = study
    made(config, 0, 1)
    for name, spec in specs.items():
        alone = engines.make(spec, Path("alone", name))
        assert RunStore().result(name)["metrics"] == alone["metrics"]
        states = (
            Path(place, name, "final.npz").read_bytes() for place in ("results/runs", "alone")
        )
        assert len(set(states)) == 1


def test_a_stage_that_goes_on_without_a_run_keeps_its_failure(study, monkeypatch, capsys):
    config, specs = study
    true, bad, began = engines.make, sorted(specs)[1], []

    def make(spec, out, *arguments, **options):
        began.append(out.name)
        if out.name == bad:
            raise BlowUpError(particle=1, time=0.1, reason="overlap", hint="the time step")
        return true(spec, out, *arguments, **options)

    monkeypatch.setattr(engines, "make", make)
    for _ in range(2):
        made(config, 0, 1, kept=True)
        assert json.loads(Path("done.json").read_text())["runs"] == sorted(specs)
    assert sorted(began) == sorted(specs)
    assert RunStore().failure(bad)["kind"] == "BlowUpError"
    assert not list(Path("results").rglob("failed.yaml"))
    assert "overlap" not in capsys.readouterr().err


def test_a_batch_goes_on_after_a_run_that_failed_and_tells_of_it(study, monkeypatch, capsys):
    config, specs = study
    true, bad = engines.make, sorted(specs)[1]

    def make(spec, out, *arguments, **options):
        if out.name == bad:
            raise BlowUpError(particle=1, time=0.1, reason="overlap", hint="the time step")
        return true(spec, out, *arguments, **options)

    monkeypatch.setattr(engines, "make", make)
    with pytest.raises(SystemExit):
        made(config, 0, 1)
    assert f"run {bad} failed: particle 1" in capsys.readouterr().err
    there = [n for n in sorted(specs) if RunStore().current(n)]
    assert there == [n for n in sorted(specs) if n != bad]
    assert not Path("done.json").exists()
    assert "overlap" in Path(f"results/runs/{bad}/run.log").read_text()
    assert Path(f"results/runs/{bad}/failed.yaml").exists()
    monkeypatch.setattr(engines, "make", true)
    made(config, 0, 1)
    assert Path("batch.log").read_text().count("was there") == 2
    assert json.loads(Path("done.json").read_text())["runs"] == sorted(specs)


def test_a_batch_that_is_asked_to_stop_begins_no_further_run(study, monkeypatch, capfd):
    config, _ = study
    began = []

    def stopped(spec, out, *_, **__):
        began.append(out.name)
        raise StoppedError("stopped at 0 %")

    monkeypatch.setattr(engines, "make", stopped)
    with pytest.raises(SystemExit):
        made(config, 0, 1)
    assert len(began) == 1
    # it is no failure of the run, and is counted as none
    assert not list(Path("results").rglob("failed.yaml"))
    assert capfd.readouterr().err == f"run {began[0]}: stopped at 0 %\n"
    assert Path("batch.log").read_text() == f"{began[0]} stopped at 0 %\n"


@pytest.mark.parametrize("damage", [pytest.param("removed", marks=pytest.mark.slow), "changed"])
def test_the_mark_of_a_batch_falls_with_one_of_its_runs(study, damage):
    config, specs = study
    folder = Path(f"results/{config.name}/screening")
    mark = folder / "batches" / "0.json"
    made(config, 0, 1, mark)
    assert lost_runs(folder, RunStore()) == []
    result = Path("results/runs") / sorted(specs)[2] / "result.json"
    if damage == "removed":
        result.unlink()
    else:
        result.write_text(result.read_text().replace("seed", "sead", 1))
    [lost] = lost_runs(folder, RunStore())
    assert lost == result.parent.name
    assert batch_of(specs, 2)[lost] == 0
