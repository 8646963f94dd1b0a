"""The benchmark's own parts: beds side by side, the history. Speeds are not
tested."""

import csv

import numpy as np
import pytest

from benchmarks.speed import __main__ as report
from benchmarks.speed.__main__ import append
from benchmarks.speed.cases import RADIUS, bed, tiled
from benchmarks.speed.peers import LOOP, _seconds


@pytest.fixture(scope="module")
def small():
    return bed(300)


@pytest.mark.slow
def test_beds_side_by_side_fill_the_box_and_do_not_overlap_at_the_seams(small):
    position, width = tiled(small, 3000, 3)
    assert position.shape == (9 * 300, 3)
    assert position[:, :2].min() > 0.99 * RADIUS
    assert position[:, :2].max() < width - 0.99 * RADIUS
    near = np.linalg.norm(position[:, None] - position[None], axis=2)
    np.fill_diagonal(near, np.inf)
    alone = near[:300, :300].min()
    # walls carry the grains beside a seam with as small an overlap as grains carry each other
    assert near.min() > min(alone, 2.0 * RADIUS) - 1e-3 * RADIUS


def test_a_tiled_bed_starts_at_rest(small):
    start = tiled(small, 0, 2)
    sim = bed(1200, start=start, stir=0.0)
    assert sim.n == 1200
    assert sim.kinetic_energy() < 1e-6 * bed(1200).kinetic_energy()


def test_a_line_names_a_changed_tree_and_an_old_history_keeps_its_lines(tmp_path, monkeypatch):
    monkeypatch.setattr(report, "tree", lambda: ("abc", 2))
    monkeypatch.setattr(report, "load", lambda: 3.5)
    history = tmp_path / "history.csv"
    history.write_text("date,engine,case,particle_steps_per_s\n2026-01-01,e,settled bed,1e7\n")
    append(history, [{"case": "settled bed", "particle_steps_per_s": 2e7}])
    with history.open(newline="") as stream:
        old, new = csv.DictReader(stream)
    assert (old["date"], old["particle_steps_per_s"], old["commit"]) == ("2026-01-01", "1e7", "")
    assert (new["commit"], new["dirty_files"], new["load"]) == ("abc", "2", "3.5")


def test_another_engine_is_timed_by_the_processor_it_had_in_its_last_three_blocks():
    loops = "".join(f"Loop time of {wall} on 1 procs\n" for wall in (9.0, 2.0, 4.0, 6.0))
    assert _seconds(LOOP, (loops, 10.0, 20.0)) == [1.0, 2.0, 3.0]
