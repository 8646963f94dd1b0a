"""The parameters as a distribution, and how they go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.figures.labels import label
from calibration.figures.style import BLUE, GREY, ORANGE, styled
from calibration.statistics.numbers import fixed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.statistics.factor import CodedFactor


BINS = 24
SHOWN = 200  # draws that a pair shows; each is a mark of its own in the page


def posterior_pairs(
    region: Sequence[CodedFactor],
    draws: pd.DataFrame,
    parameters: Mapping[str, Mapping[str, Any]],
    middle: Mapping[str, float],
) -> Figure:
    """Each parameter's distribution with its interval on the diagonal, each pair below it.

    region: `Factor`s; draws: table of natural levels; parameters: {name: {interval}}; middle:
    {name: natural level} of a set that stands for all. The frame is the prior's box.
    """
    d = len(region)
    with styled() as plt:
        size = 2.6 * max(d, 1.6)
        figure, axes = plt.subplots(
            d, d, figsize=(size, 0.92 * size), layout="constrained", squeeze=False
        )
    for i, row in enumerate(region):
        for j, column in enumerate(region):
            ax = axes[i, j]
            if j > i:
                ax.set_axis_off()
                continue
            if i == j:
                _marginal(ax, row, draws[row.name], parameters[row.name], middle)
            else:
                _pair(ax, row, column, draws, middle)
            ax.set_xlim(column.low, column.high)
            ax.set_xlabel(label(column.name) if i == d - 1 else "", fontsize=8)
            ax.set_ylabel(label(row.name) if j == 0 and i else "", fontsize=8)
            ax.tick_params(labelsize=7)
    return figure


def _marginal(ax, factor, levels, found, middle):
    ax.hist(levels, BINS, range=(factor.low, factor.high), density=True, color=BLUE, alpha=0.55)
    ax.axhline(1.0 / (factor.high - factor.low), color=GREY, lw=1, ls=":")
    ax.axvspan(*found["interval"], color=BLUE, alpha=0.12, lw=0)
    ax.axvline(middle[factor.name], color=ORANGE, lw=1.5)
    ax.set_yticks([])


def _pair(ax, row, column, draws, middle):
    x, y = draws[column.name], draws[row.name]
    some = np.linspace(0, len(x) - 1, min(SHOWN, len(x))).astype(int)
    ax.scatter(x.iloc[some], y.iloc[some], s=6, color=BLUE, alpha=0.45, lw=0)
    ax.plot(middle[column.name], middle[row.name], "o", color="white", mec=ORANGE, mew=2, ms=7)
    ax.set_ylim(row.low, row.high)
    ax.set_title(f"correlation {fixed(np.corrcoef(x, y)[0, 1], 2, '+')}", fontsize=7)
