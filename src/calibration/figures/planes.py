"""What figures over pairs of factors share."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

    from calibration.statistics.factor import CodedFactor


def pairs_of(region: Sequence[CodedFactor]) -> list[tuple[int, int]]:
    """All pairs (i, j), i < j, of a region's factors by their number."""
    return list(combinations(range(len(region)), 2))


def plane(
    region: Sequence[CodedFactor],
    i: int,
    j: int,
    at: np.ndarray | None = None,
    resolution: int = 61,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A square grid over factors i and j: natural levels of i and of j (m, m), and the coded levels
    (m m, factors) of its points. The other factors are at the coded levels `at` (factors,), the
    centre unless given."""
    line = np.linspace(-1.0, 1.0, resolution)
    a, b = np.meshgrid(line, line)
    levels = np.tile(np.zeros(len(region)) if at is None else at, (a.size, 1))
    levels[:, i], levels[:, j] = a.ravel(), b.ravel()
    return region[i].natural(a), region[j].natural(b), levels


def label_3d(ax: Axes3D, x: str, y: str, z: str) -> None:
    """Label the axes of a small three-dimensional panel, which else run into each other."""
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.set_zlabel(z, fontsize=8)
    ax.tick_params(labelsize=7)
    ax.locator_params(nbins=4)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.set_box_aspect(None, zoom=0.85)
