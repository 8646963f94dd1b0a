"""A run that is killed at a random moment goes on from its checkpoint and ends where it would have
ended."""

import os
import random
import subprocess
import sys
import time

import numpy as np
import yaml

from dem.template import template

CHANGES = {
    "particles": {"count": 150, "diameter_mm": 4.0},
    "geometry": {"orifice_diameter_mm": 32, "plate_diameter_mm": 50},
    "output": {"checkpoint_interval_s": 0.01},
}


def start(spec, out, stderr=subprocess.DEVNULL):
    """Begin `dem run` in a process of its own."""
    command = [sys.executable, "-c", "from dem.cli import main; raise SystemExit(main())"]
    return subprocess.Popen(
        [*command, "run", str(spec), "--out", str(out)], stderr=stderr, text=True
    )


def kill_after_a_new_checkpoint(process, checkpoint, wait):
    """End the process without warning, `wait` seconds after it has replaced its checkpoint."""
    before = os.stat(checkpoint).st_mtime_ns if checkpoint.exists() else 0
    while not checkpoint.exists() or os.stat(checkpoint).st_mtime_ns == before:
        assert process.poll() is None, "the run ended before it could be killed"
        time.sleep(0.005)
    time.sleep(wait)
    process.kill()
    return process.wait()


def heap_spec(folder, **output):
    spec = folder / "heap.yaml"
    mapping = yaml.safe_load(template("heap"))
    for part, values in CHANGES.items():
        mapping[part] |= values
    mapping["output"] |= output
    spec.write_text(yaml.safe_dump(mapping))
    return spec


def test_a_run_killed_at_random_moments_ends_as_an_uninterrupted_one(tmp_path):
    spec = heap_spec(tmp_path)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert start(spec, whole).wait() == 0

    waits = [random.uniform(0, 0.1) for _ in range(2)]  # no seed: the claim is for every moment
    for wait in waits:
        assert kill_after_a_new_checkpoint(start(spec, broken), broken / "checkpoint.npz", wait) < 0
        assert not (broken / "result.json").exists()
    assert start(spec, broken).wait() == 0

    assert (broken / "result.json").exists()
    assert not (broken / "checkpoint.npz").exists()
    with np.load(whole / "final.npz") as a, np.load(broken / "final.npz") as b:
        assert set(a.files) == set(b.files)
        for name in a.files:
            np.testing.assert_array_equal(
                a[name], b[name], err_msg=f"{name}, killed after {waits} s"
            )
