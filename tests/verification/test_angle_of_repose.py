"""The angle that is read from heaps of separate grains whose cone is known: what the size of the
grains costs."""

import numpy as np
import pytest

from dem.measure.heap import measure_heap

PLATE = 0.04


def packed_cone(angle, radius, seed):
    """Centres (n, 3) [m] of spheres on a jittered face-centred lattice, those that lie whole under
    the cone.

    angle [deg]; radius [m]. The lattice's spacing of 2.2 radii keeps them apart; its origin and
    direction are random."""
    rng = np.random.default_rng(seed)
    cell = 2.2 * np.sqrt(2.0) * radius
    slope = np.radians(angle)
    across, up = int(PLATE / cell) + 2, int(PLATE * np.tan(slope) / cell) + 2
    corner = np.stack(np.meshgrid(*2 * [np.arange(-across, across)], np.arange(up)), -1)
    basis = np.array([(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
    p = cell * (corner.reshape(-1, 1, 3) + basis).reshape(-1, 3)
    c, s = np.cos(turn := rng.uniform(0.0, 2.0 * np.pi)), np.sin(turn)
    p = p @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [*rng.uniform(0, cell, 2), radius]
    p += rng.uniform(-0.05, 0.05, p.shape) * radius
    depth = (PLATE - np.hypot(p[:, 0], p[:, 1])) * np.sin(slope) - p[:, 2] * np.cos(slope)
    return p[depth > radius]


# An outline is the highest grain along the line of sight. Near the apex there are fewer to choose
# from than near the toe, so the outline sinks from the cone towards the top and reads low, the more
# the fewer grains the heap is high.
TOLERANCE = {1.0: 0.5, 2.0: 1.0, 4.0: 2.5}


@pytest.mark.parametrize(
    ("angle", "diameter"),
    [
        pytest.param(35, 1.0, marks=pytest.mark.slow),
        *[(a, d) for a in (25, 40, 55) for d in (2.0, 4.0)],
    ],
)
def test_angle_of_a_cone_of_separate_grains(record, angle, diameter):
    read = []
    for seed in range(4):
        p = packed_cone(angle, 0.5e-3 * diameter, seed)
        heap = measure_heap(p, np.full(len(p), 0.5e-3 * diameter), np.zeros_like(p), PLATE)
        read.append((heap["angle_of_repose_deg"], heap["radial_angle_deg"]))
    for name, value in zip(("silhouettes", "radial surface"), np.mean(read, axis=0), strict=True):
        quantity = f"{name}, grains of {diameter:g} mm on a disc of 80 mm"
        tolerance = TOLERANCE[diameter]
        record("angle of repose of a cone", quantity, value, angle, tolerance, "deg", "geometry")
        assert value < angle, "the grains lie under the cone and can only lower it"
