"""No number comes out of a result that was changed, cut off, copied from another run or made by
another engine; what a plan or a rule has left is known again; no file of the user is touched."""

import errno
import json
import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from calibration.chain.study import Study
from calibration.errors import CalibrationError, ConfigError
from calibration.files import set_aside
from calibration.interface.cli import main
from calibration.runs import store as store_module
from calibration.runs.plans import read_metric, read_plan, run_id, write_plan
from calibration.runs.simulated import simulate, untested
from calibration.runs.store import RunStore
from calibration.runs.verify import (
    FOLDER,
    faults_of,
    hold,
    lost_runs,
    made_again,
    plan_faults,
    read_record,
    record,
    refuse_others,
    refuse_outside,
    repair,
    untrusted,
)
from calibration.stages.screening import plan_screening
from calibration.study.config import parse_config
from dem.errors import BlowUpError, MeasureError, RefusedStateError
from dem.experiments import phases
from dem.io.files import sealed
from dem.io.stl import write_stl
from dem.results import write_failure, write_result
from dem.spec import parse_spec
from facts import ROOT, refused, tells
from stage_files import PlanFiles

NO_STUDY = SimpleNamespace(name="none", results="results")
"""Settings of a study that has planned nothing."""


def drop(seed):
    return {"experiment": "drop", "seed": seed, "geometry": {"drop_height_mm": 5.0, "drops": 1}}


def make(spec, value):
    """A finished run as the engine leaves it."""
    folder = Path("results/runs") / run_id(spec)
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(folder / "final.npz", position=np.full((10, 3), value))
    metrics = {"rebound_height_mm": value}
    write_result(folder, parse_spec(spec), metrics, {"wall_time_s": 2.0})
    return folder.name


@pytest.fixture
def names(tmp_path, monkeypatch):
    """Three finished runs in a folder of their own, each checked once."""
    monkeypatch.chdir(tmp_path)
    found = [make(drop(seed), 1.5 + seed) for seed in range(3)]
    assert read_metric(found, "rebound_height_mm") == [1.5, 2.5, 3.5]
    return found


def result_of(name):
    return Path("results/runs") / name / "result.json"


def truncated(path):
    path.write_bytes(path.read_bytes()[:-40])


def other_digit(path):
    path.write_text(path.read_text().replace("2.5", "2.6"))


def other_digit_and_its_old_time(path):
    before = path.stat()
    other_digit(path)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def of_another_run(path):
    other = next(p for p in path.parents[1].glob("*/result.json") if p != path)
    shutil.copy2(other, path)


def whole_folder_of_another_run(path):
    other = next(p for p in path.parents[1].glob("*/result.json") if p != path).parent
    shutil.rmtree(path.parent)
    shutil.copytree(other, path.parent)


def without_manifest(path):
    path.write_text(json.dumps({"metrics": {"rebound_height_mm": 2.5}, "engine": "0" * 16}))


DAMAGE = {
    "truncated result": truncated,
    "empty result": lambda p: p.write_bytes(b""),
    "a digit changed": other_digit,
    "a digit changed, the old time": other_digit_and_its_old_time,
    "another run's result": of_another_run,
    "another run's folder": whole_folder_of_another_run,
    "no manifest": without_manifest,
    "state deleted": lambda p: (p.parent / "final.npz").unlink(),
    "state truncated": lambda p: truncated(p.parent / "final.npz"),
}


def tree(folder="."):
    """{path: its time and content} of all below a folder."""
    found = sorted(Path(folder).rglob("*"))
    return {p: (p.lstat().st_mtime_ns, p.read_bytes() if p.is_file() else None) for p in found}


def told(config):
    """What a start says; it looks, and writes nothing."""
    before = tree()
    said, _ = untrusted(config, RunStore(looks_only=True))
    assert tree() == before
    return said


def set_faults_aside(config):
    """As a start does."""
    repair(untrusted(config, RunStore())[1], config.results)


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_run_is_never_read_and_counts_as_missing(names, damage):
    damage(result_of(names[1]))
    with pytest.raises(CalibrationError, match=names[1]):
        read_metric(names, "rebound_height_mm")
    assert [f.run for f in faults_of()] == [names[1]]
    [said] = told(NO_STUDY)
    assert names[1] in said
    set_faults_aside(NO_STUDY)
    assert not result_of(names[1]).exists()
    assert result_of(names[0]).exists()
    assert told(NO_STUDY) == []


def test_layout_and_order_of_keys_are_no_damage(names):
    path = result_of(names[1])
    data = json.loads(path.read_text())
    path.write_text(json.dumps(dict(reversed(data.items()))))
    assert read_metric(names, "rebound_height_mm") == [1.5, 2.5, 3.5]
    assert list(faults_of()) == []


def test_a_copy_of_the_whole_store_is_as_good(names, tmp_path):
    shutil.copytree("results", tmp_path / "there" / "results")
    assert list(faults_of(tmp_path / "there" / "results")) == []
    assert main(["verify", str(tmp_path / "there" / "results")]) == 0


def test_a_result_of_another_engine_is_no_number_of_this_one(names, monkeypatch):
    monkeypatch.setattr("dem.results.engine_fingerprint", lambda: "f" * 16)
    with pytest.raises(CalibrationError, match="another engine"):
        read_metric(names, "rebound_height_mm")
    assert RunStore().current(names[0]) is None
    assert [f.stale for f in faults_of()] == [True] * 3


def test_an_unchanged_run_is_hashed_once_for_all(names, monkeypatch):
    """The index answers for it; a line of it that was cut off answers for nothing."""
    hashed = []
    true = store_module.read_result
    monkeypatch.setattr(
        store_module,
        "read_result",
        lambda folder, files=True: hashed.append(folder.name) if files else true(folder, False),
    )
    store = RunStore()
    assert {store.entry(n)["wall_time_s"] for n in names} == {2.0}
    assert hashed == []
    monkeypatch.setattr(store_module, "read_result", true)
    index = Path("results/runs/index.jsonl")
    index.write_bytes(index.read_bytes()[:-30] + b"\n{not a line\n")
    assert RunStore().entry(names[2])["run"] == names[2]
    assert len(index.read_text().splitlines()) > 3


def test_a_store_that_can_only_be_read_is_read(names, monkeypatch):
    Path("results/runs/index.jsonl").unlink()

    def refuse(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(store_module.os, "open", refuse)
    assert read_metric(names, "rebound_height_mm") == [1.5, 2.5, 3.5]


PASSING = [
    OSError(errno.ENOSPC, "No space left on device"),
    RuntimeError("cannot cache function 'advance': no locator available for file 'step.py'"),
]


@pytest.mark.parametrize("fault", PASSING, ids=lambda e: type(e).__name__)
def test_a_passing_fault_of_the_machine_is_not_kept(tmp_path, monkeypatch, fault):
    monkeypatch.chdir(tmp_path)
    specs = {run_id(s): s for s in (drop(0), drop(1))}
    first, second = specs

    def broken(spec, folder, *_, **__):
        if folder.name == first:
            raise fault
        make(spec.model_dump(mode="json", exclude_none=True), 1.0)
        return {"metrics": {"rebound_height_mm": 1.0}}

    monkeypatch.setattr("calibration.engines.run", broken)
    with pytest.raises(CalibrationError, match=first):
        simulate(specs)
    assert RunStore().current(second), "the other runs go on"
    assert not (Path("results/runs") / first / "failed.json").exists()
    fault = None
    monkeypatch.setattr(
        "calibration.engines.run",
        lambda spec, folder, *_, **__: {"metrics": {"n": make(drop(0), 2.0)}},
    )
    assert set(simulate(specs)) == {first, second}


def refusal(refuse, *args):
    """What the engine raises of a state that it refuses."""
    with pytest.raises(RefusedStateError) as caught:
        refuse(*args)
    return caught.value


@pytest.mark.parametrize(
    ("error", "no_test"),
    [
        (MeasureError("no heap"), False),
        (BlowUpError(particle=1, time=0.1, reason="overlap", hint="the time step"), True),
        (refusal(phases.refuse, "pouring", 1.0, 0.5, np.nan), True),
        (RefusedStateError("clogged", "the funnel is clogged"), False),
    ],
)
def test_a_physical_failure_is_kept(tmp_path, monkeypatch, error, no_test):
    monkeypatch.chdir(tmp_path)
    name, calls = run_id(drop(0)), []

    def fails(*_, **__):
        calls.append(1)
        raise error

    monkeypatch.setattr("calibration.engines.run", fails)
    for _ in range(2):
        assert simulate({name: drop(0)}) == {name: None}
    assert len(calls) == 1
    assert untested([name, "heap-0"]) == ({name} if no_test else set())
    failed = Path("results/runs") / name / "failed.json"
    failed.write_text(failed.read_text().replace("0", "1"))
    simulate({name: drop(0)})
    assert len(calls) == 2


@pytest.fixture
def study(with_data):
    """A screening of heaps on a mesh, planned from a table of its own."""
    corners = np.array([(0, 0, 0), (80, 0, 0), (0, 80, 0), (0, 0, 80)], float)
    write_stl("plate.stl", corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]))
    shutil.copy(ROOT / "data/paper/table06_plackett_burman.csv", "table.csv")
    config = parse_config(
        {
            "name": "meshed",
            "factors": "config/factors.tsv",
            "measurements": "data/paper/measurements.csv",
            "tests": {"heap": {"experiment": "heap"}},
            "run": {"geometry": {"plate_stl": "plate.stl"}},
            "screening": {"design": "table.csv"},
        }
    )
    planned = PlanFiles.of("results/meshed/screening")
    plan_screening(Study(config), None, planned)
    record("results/meshed", "plan_screening", "abc", planned)
    return config


def test_a_mesh_halved_in_place_is_another_run(study):
    folder = Path("results/meshed/screening")
    name, spec = next(iter(read_plan(folder / "plan.json").items()))
    corners = np.array([(0, 0, 0), (40, 0, 0), (0, 40, 0), (0, 0, 40)], float)
    write_stl("plate.stl", corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]))
    assert run_id(spec) != name
    assert "is now" in str(next(plan_faults(folder)))
    assert f"{folder}/plan.json: {name} is now" in told(study)[0]
    set_faults_aside(study)
    assert not (folder / "plan.json").exists()


@pytest.mark.parametrize(
    ("table", "damage"),
    [
        ("design.csv", lambda text: text.replace("-1", "1", 1)),
        ("plan.json", lambda text: text.replace('"seed": 1', '"seed": 2', 1)),
        ("plan.json", lambda text: text[:-9]),
    ],
    ids=["design edited", "plan edited", "plan cut off"],
)
def test_an_edited_or_deleted_design_is_planned_again(study, table, damage):
    file, folder = Path("results/meshed/screening", table), Path("results/meshed")
    assert faults_of() == []
    assert not made_again(folder, "plan_screening", [])
    file.write_text(damage(file.read_text()))
    assert {fault.file for fault in faults_of()} == {file}
    assert told(study)[-1].startswith(str(file))
    set_faults_aside(study)
    assert not file.exists()
    assert Path(f"{file}.damaged").exists()
    [said] = told(study)
    assert tells(said, str(file), "missing")
    assert made_again(folder, "plan_screening", [])


def test_verify_says_what_is_wrong_and_repair_sets_it_aside(names, capsys):
    assert main(["verify"]) == 0
    assert "3 runs, 0 faults" in capsys.readouterr().out
    table, specs = pd.DataFrame({"run_id": names}), {run_id(drop(n)): drop(n) for n in range(3)}
    write_plan("results/none/screening/plan.json", table, specs)
    record("results/none", "plan_screening", "a", PlanFiles.of("results/none/screening"))
    assert lost() == []
    other_digit(result_of(names[1]))
    assert main(["verify", "results"]) == 1
    assert f"{names[1]}/result.json: has changed" in capsys.readouterr().out
    assert main(["verify", "results", "--repair"]) == 0
    assert main(["verify"]) == 0
    assert lost() == [names[1]]


def test_two_calls_do_not_work_in_one_folder(names):
    from filelock import FileLock

    with FileLock("results/.lock"), pytest.raises(CalibrationError, match="--config results="):
        hold("results")
    assert told(NO_STUDY) == []


def test_a_job_of_the_call_that_holds_a_folder_works_there(tmp_path, monkeypatch):
    monkeypatch.setenv("CALIBRATION_HELD", "")
    hold(tmp_path)
    hold(tmp_path)  # as a job does, which has the environment of the call
    monkeypatch.setenv("CALIBRATION_HELD", "")  # a stranger has not
    with refused(CalibrationError, str(tmp_path), "another call"):
        hold(tmp_path)


def lost():
    return lost_runs("results/none/screening", RunStore(looks_only=True))


def test_a_failure_of_another_engine_is_missing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name, folder = run_id(drop(0)), Path("results/none/screening")
    (Path("results/runs") / name).mkdir(parents=True)
    write_failure(Path("results/runs") / name, parse_spec(drop(0)), MeasureError("no heap"))
    write_plan(folder / "plan.json", pd.DataFrame({"run_id": [name]}), {name: drop(0)})
    assert lost() == []
    monkeypatch.setattr("dem.results.engine_fingerprint", lambda: "f" * 16)
    assert lost() == [name]


def test_only_what_this_project_made_is_set_aside(names):
    """Beside the studies of a folder of results others may lie, with a plan.json of their own."""
    other = Path("results/projects/plan.json")
    other.parent.mkdir()
    other.write_text("mine")
    before = tree(other.parent)
    assert faults_of() == []
    set_faults_aside(NO_STUDY)
    assert tree(other.parent) == before


# --- what rules have left --------------------------------------------------------------

NAME = "screening"


@pytest.fixture
def left(tmp_path):
    """A study's folder with a table that a rule has left, beside a table of the user."""
    folder = tmp_path / "results" / "wheat"
    folder.mkdir(parents=True)
    (folder / "effects.csv").write_text("1")
    (folder / "heaps").mkdir()
    outputs = [folder / "effects.csv", folder / "heaps", folder / "none.csv"]
    record(folder, NAME, "abc", outputs)
    return folder


def table_of(folder):
    return folder / "effects.csv"


def record_of(folder):
    return folder / FOLDER / f"{NAME}.json"


def stale(folder, content=None):
    """Whether the files are to be made again."""
    return made_again(folder, NAME, [table_of(folder)], content)


def test_an_edited_file_is_found(left):
    assert faults_of(left.parent) == []
    assert not stale(left)
    assert not stale(left, "abc")
    assert stale(left, "abd")
    table_of(left).write_text("2")
    assert [fault.file for fault in faults_of(left.parent)] == [table_of(left)]
    assert stale(left)


DAMAGED_RECORD = {
    "missing": Path.unlink,
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-9]),
    "another digest": lambda path: path.write_text(path.read_text().replace("abc", "abd")),
}


@pytest.mark.parametrize("damage", DAMAGED_RECORD.values(), ids=DAMAGED_RECORD)
def test_a_record_that_is_missing_or_damaged_makes_the_files_again(left, damage):
    damage(record_of(left))
    assert table_of(left) not in {fault.file for fault in faults_of(left.parent)}
    assert stale(left)


OUTSIDE = {
    "above": lambda study: "../../thesis.txt",
    "behind a link": lambda study: "link/thesis.txt",
}


@pytest.mark.parametrize("name", OUTSIDE.values(), ids=OUTSIDE)
def test_a_record_that_names_a_file_outside_of_the_study_is_none(left, name):
    """Its checksum fits: whoever sends a study can compute it."""
    outside = left.parents[1] / "thesis.txt"
    outside.write_text("years of work")
    (left / "link").symlink_to(outside.parent)
    found = read_record(record_of(left)) | {"files": {name(left): "0" * 64}}
    record_of(left).write_text(json.dumps(sealed(found)))
    assert read_record(record_of(left)) is None
    assert [fault.file for fault in faults_of(left.parent)] == [record_of(left)]
    repair(faults_of(left.parent), left.parent)
    assert outside.read_text() == "years of work"
    assert list(outside.parent.glob("thesis*")) == [outside]


def test_a_second_setting_aside_keeps_the_first(tmp_path):
    file = tmp_path / "table.csv"
    for text in ("first", "second", "third"):
        file.write_text(text)
        set_aside(file)
    assert not file.exists()
    kept = [tmp_path / f"table.csv.damaged{end}" for end in ("", ".2", ".3")]
    assert [path.read_text() for path in kept] == ["first", "second", "third"]


def test_what_is_set_aside_leaves_a_folder_that_is_made_again(left):
    """snakemake deletes a deck, a folder that is a rule's output, before it makes it again."""
    deck = left / "exports/lammps/in.lammps"
    deck.parent.mkdir(parents=True)
    deck.write_text("as written")
    record(left, "export", "abc", [deck])
    deck.write_text("as edited")
    repair(faults_of(left.parent), left.parent)
    assert not deck.exists()
    assert (left / "exports/in.lammps.damaged").read_text() == "as edited"


def test_a_folder_of_somebody_else_is_refused(tmp_path):
    folder = tmp_path / "projects"
    refuse_others(folder)
    (folder / "logs").mkdir(parents=True)
    refuse_others(folder)
    (folder / "plan.json").write_text("{}")
    with refused(ConfigError, str(folder), FOLDER):
        refuse_others(folder)
    (folder / FOLDER).mkdir()
    refuse_others(folder)


@pytest.mark.parametrize("results", ["../home", "/scratch/me", "a/../../home"])
def test_results_elsewhere_are_asked_for_on_the_command_line(results, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with refused(ConfigError, "results", results, f"--config results={results}"):
        refuse_outside(results, {"name": "projects"})
    refuse_outside(results, {"results": results})
    refuse_outside("kept/here", None)
