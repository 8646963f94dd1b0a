"""What a run does when it is stopped, killed, disturbed or damaged. The experiment counts to ten in
place of pouring grains, so that what is tried is the run around it; the last test kills a heap."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
import types

import numpy as np
import pytest
import yaml
from filelock import FileLock

import dem.run
from calibration.study.config import overlay
from dem.errors import BusyError, MeasureError, StoppedError
from dem.io.files import read_checked_arrays, write_checked_arrays
from dem.results import read_result
from dem.run import RunContext, finished, run
from dem.spec import load_spec, parse_spec
from dem.template import template
from dem.walls.state import new_walls
from facts import refused

SPEC = parse_spec({"experiment": "drop", "seed": 7, "output": {"checkpoint_interval_s": 1e-9}})
NEVER = parse_spec({"experiment": "drop", "seed": 7, "output": {"checkpoint_interval_s": 1e9}})


class Counting:
    """Adds up 0 to 9, a step a checkpoint; `at` {step: what happens there}."""

    def __init__(self, at=None, keeps=True, value=None):
        self.at, self.keeps, self.value = at or {}, keeps, value
        self.began = None

    def perform(self, spec, context):
        resumed = context.resume()
        step, total = (0, 0.0) if resumed is None else (resumed[1]["step"], resumed[1]["total"])
        self.began = step
        while step < 10:
            total, step = total + step, step + 1
            if step in self.at:
                self.at[step]()
            context.progress(step / 10, f"step {step}")
            if self.keeps:
                state = {"particles_position": np.full((2, 3), total)}
                context.checkpoint(lambda x=state, s=step, t=total: (x, {"step": s, "total": t}))
        ones, one = np.ones((2, 3)), np.ones(2)
        context.finish(
            types.SimpleNamespace(
                position=ones, radius=one, velocity=ones, spin=ones, tag=one, grain=one,
                time_step=1.0, steps=10, time=10.0, rebuilds=0, precision="mixed",
                wall_state=new_walls(0, 0), gravity=np.array([0.0, 0.0, -9.81]), n=2, mass=one,
            )
        )  # fmt: skip
        return {"rebound_height_mm": total if self.value is None else self.value}


@pytest.fixture
def counting(monkeypatch):
    """Make runs of an experiment that counts."""

    def use(**options):
        experiment = Counting(**options)
        monkeypatch.setattr(dem.run, "experiment_of", lambda spec: experiment)
        return experiment

    return use


def stop():
    os.kill(os.getpid(), signal.SIGTERM)


def test_a_run_leaves_its_result_and_its_state_alone(counting, tmp_path):
    counting()
    assert run(SPEC, tmp_path / "a")["metrics"] == {"rebound_height_mm": 45.0}
    assert sorted(os.listdir(tmp_path / "a")) == ["final.npz", "result.json"]
    assert read_result(tmp_path / "a") == finished(tmp_path / "a")
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize("spec", [SPEC, NEVER], ids=["often", "never by itself"])
def test_sigterm_saves_the_state_and_the_run_goes_on_from_there(counting, tmp_path, spec):
    counting(at={6: stop})
    with refused(StoppedError, "60 %"):
        run(spec, tmp_path / "a")
    assert not (tmp_path / "a" / "result.json").exists()
    experiment = counting()
    assert run(spec, tmp_path / "a")["metrics"] == {"rebound_height_mm": 45.0}
    assert experiment.began == 6
    assert sorted(os.listdir(tmp_path / "a")) == ["final.npz", "result.json"]


def limited():
    """From here on no file may grow beyond a thousand bytes, as on a disk that is full."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))


def test_a_disk_that_fills_up_under_way_leaves_nothing_half_written(counting, tmp_path):
    counting(at={4: limited})
    try:
        with pytest.raises(OSError, match="File too large"):
            run(SPEC, tmp_path / "a")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
    assert sorted(os.listdir(tmp_path / "a")) == [".lock", "checkpoint.npz"]
    experiment = counting()
    assert run(SPEC, tmp_path / "a")["metrics"] == {"rebound_height_mm": 45.0}
    assert experiment.began == 3


def cut(path):
    counted_bytes = path.read_bytes()
    path.write_bytes(counted_bytes[: len(counted_bytes) // 2])


def flip(path, at=200):
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(bytes(content))


def not_finite(path):
    """A state with NaN and a checksum that fits."""
    arrays = read_checked_arrays(path)
    arrays["particles_position"][0, 0] = np.nan
    write_checked_arrays(path, arrays)


@pytest.mark.parametrize("damage", [cut, flip, not_finite], ids=lambda d: d.__name__)
def test_a_damaged_checkpoint_is_never_resumed(counting, tmp_path, damage):
    counting(at={6: stop})
    with pytest.raises(StoppedError):
        run(SPEC, tmp_path / "a")
    damage(tmp_path / "a" / "checkpoint.npz")
    experiment, told = counting(), []
    assert run(SPEC, tmp_path / "a", lambda _, text: told.append(text))["metrics"]
    assert experiment.began == 0
    assert any("begins anew" in text for text in told)


def test_each_byte_of_a_checkpoint_counts(counting, tmp_path):
    counting(at={6: stop})
    with pytest.raises(StoppedError):
        run(SPEC, tmp_path)
    path = tmp_path / "checkpoint.npz"
    whole, context = path.read_bytes(), RunContext(SPEC, tmp_path)
    assert context.resume() is not None
    for at in range(0, len(whole), 7):
        flip(path, at)
        assert context.resume() is None
        path.write_bytes(whole)


def test_what_killed_writers_left_is_swept(counting, tmp_path):
    counting()
    for name in (".checkpoint.npz.123.partial", ".result.json.9.partial"):
        (tmp_path / name).write_bytes(b"half")
    run(SPEC, tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["final.npz", "result.json"]


def test_no_second_writer_enters_a_run(counting, tmp_path):
    counting()
    with FileLock(tmp_path / ".lock"), pytest.raises(BusyError, match="another process"):
        run(SPEC, tmp_path, wait=False)
    assert not (tmp_path / "result.json").exists()


def test_who_waited_for_a_run_takes_its_result(counting, tmp_path):
    experiment = counting()
    first = run(SPEC, tmp_path)
    experiment.began = None
    assert run(SPEC, tmp_path, again=False) == first
    assert experiment.began is None
    (tmp_path / "final.npz").write_bytes(b"cut off")
    assert run(SPEC, tmp_path, again=False)["metrics"] == first["metrics"]
    assert experiment.began == 0


def test_a_metric_that_is_no_number_is_no_result(counting, tmp_path):
    counting(value=float("nan"))
    with refused(MeasureError, "drop", "rebound_height_mm"):
        run(SPEC, tmp_path)
    assert not (tmp_path / "result.json").exists()


def test_results_removed_under_way_are_written_anew(counting, tmp_path):
    def remove():
        for path in tmp_path.glob("*"):
            path.unlink()

    counting(at={5: remove})
    run(SPEC, tmp_path)
    assert json.loads((tmp_path / "result.json").read_text())["seed"] == 7
    assert read_result(tmp_path)["metrics"] == {"rebound_height_mm": 45.0}


CHANGES = {
    "particles": {"count": 400, "diameter_mm": 4.0},
    "geometry": {"orifice_diameter_mm": 32, "plate_diameter_mm": 50},
    "output": {"checkpoint_interval_s": 0.01},
}


def start(spec, out):
    """Begin `dem run` in a process of its own."""
    command = [sys.executable, "-m", "dem.cli", "run", str(spec), "--out", str(out)]
    return subprocess.Popen(command, stderr=subprocess.DEVNULL)


def kill_after_a_new_checkpoint(process, checkpoint, wait):
    """End the process without warning, `wait` seconds after it has replaced its checkpoint."""
    before = os.stat(checkpoint).st_mtime_ns if checkpoint.exists() else 0
    while not checkpoint.exists() or os.stat(checkpoint).st_mtime_ns == before:
        assert process.poll() is None, "the run ended before it could be killed"
        time.sleep(0.005)
    time.sleep(wait)
    process.kill()
    return process.wait()


@pytest.mark.slow
def test_a_heap_killed_at_random_moments_ends_as_an_uninterrupted_one(tmp_path):
    spec = tmp_path / "heap.yaml"
    spec.write_text(yaml.safe_dump(overlay(yaml.safe_load(template("heap")), CHANGES)))
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    run(load_spec(spec), whole)

    waits = [random.uniform(0, 0.1) for _ in range(2)]  # no seed: the claim is for every moment
    for wait in waits:
        assert kill_after_a_new_checkpoint(start(spec, broken), broken / "checkpoint.npz", wait) < 0
        assert not (broken / "result.json").exists()
    run(load_spec(spec), broken)

    assert (broken / "result.json").exists()
    assert not (broken / "checkpoint.npz").exists()
    with np.load(whole / "final.npz") as a, np.load(broken / "final.npz") as b:
        assert set(a.files) == set(b.files)
        for name in a.files:
            np.testing.assert_array_equal(
                a[name], b[name], err_msg=f"{name}, killed after {waits} s"
            )
