"""The benchmark's own beds side by side. Speeds are not tested."""

import numpy as np
import pytest

from benchmarks.speed.cases import RADIUS, bed, tiled


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
