"""What an engine could leave out that lets grains sleep, counted over a run."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.speed.cases import STILL, WINDOW, _Stillness

RADIUS = 1e-3


def _seen(time, heights, pairs):
    """A run as it is looked at: grains over one another, by tag."""
    position = np.zeros((len(heights), 3))
    position[:, 2] = heights
    return SimpleNamespace(
        time=time, n=len(heights), steps=0, tag=np.arange(len(heights)), position=position,
        radius=np.full(len(heights), RADIUS),
        contacts=lambda: (np.array(pairs, int).reshape(-1, 2), None),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("moved", "asleep", "contacts"),
    [
        (0.0, (1, 1, 1), (1, 1, 1)),
        (5e-3, (1 / 3, 1 / 3, 1), (0, 0, 1)),
        (5e-2, (1 / 3, 1 / 3, 1 / 3), (0, 0, 0)),
    ],
)
def test_a_grain_sleeps_if_its_neighbours_do(moved, asleep, contacts):
    """Grain 2 moves: it and grain 1, which touches it, are awake; grain 0 sleeps."""
    work, pairs = _Stillness(), [(0, 1), (1, 2)]
    work.frame(_seen(0.0, np.arange(3) * 2 * RADIUS, pairs))
    work.frame(_seen(WINDOW, np.arange(3) * 2 * RADIUS + [0, 0, moved * RADIUS], pairs))
    rows = work.rows()
    assert [row["radii_per_window"] for row in rows] == list(STILL)
    assert [row["ratio"] for row in rows] == pytest.approx(asleep)
    assert [row["ratio_of_contacts"] for row in rows] == pytest.approx(contacts)


def test_looks_within_a_window_are_left_out_and_grains_may_come_and_go():
    work = _Stillness()
    work.frame(_seen(0.0, [0.0, 1.0], []))
    work.frame(_seen(0.4 * WINDOW, [9.0, 9.0], []))
    work.frame(_seen(1.1 * WINDOW, [0.0, 1.0, 2.0], [(0, 1)]))
    work.frame(_seen(2.2 * WINDOW, [0.0, 1.0], []))
    assert work.rows()[0]["ratio"] == pytest.approx(4 / 5)  # the third grain has left
