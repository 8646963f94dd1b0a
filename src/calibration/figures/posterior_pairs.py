"""The parameters as a distribution: how they go together, what heaps they give, what to measure
next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.figures.labels import ANGLE, label, response_of
from calibration.figures.style import BLUE, GREEN, GREY, ORANGE, styled, subplots
from calibration.statistics.numbers import fixed
from calibration.statistics.stated import Stated

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response
    from calibration.statistics.factor import CodedFactor


BINS = 24
SHOWN = 200  # draws that a pair shows; each is a mark of its own in the page


def posterior_pairs(
    region: Sequence[CodedFactor],
    draws: pd.DataFrame,
    parameters: Mapping[str, Mapping[str, Any]],
    optimum: Mapping[str, float],
) -> Figure:
    """Each parameter's distribution with its interval on the diagonal, each pair below it.

    region: `Factor`s; draws: table of natural levels; parameters: {name: {interval}} ; optimum:
    {name: natural level} of the chosen point. The frame is the region, which is the prior's box.
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
                _marginal(ax, row, draws[row.name], parameters[row.name], optimum)
            else:
                _pair(ax, row, column, draws, optimum)
            ax.set_xlim(column.low, column.high)
            ax.set_xlabel(label(column.name) if i == d - 1 else "", fontsize=8)
            ax.set_ylabel(label(row.name) if j == 0 and i else "", fontsize=8)
            ax.tick_params(labelsize=7)
    return figure


def _marginal(ax, factor, levels, found, optimum):
    ax.hist(levels, BINS, range=(factor.low, factor.high), density=True, color=BLUE, alpha=0.55)
    ax.axhline(1.0 / (factor.high - factor.low), color=GREY, lw=1, ls=":")
    ax.axvspan(*found["interval"], color=BLUE, alpha=0.12, lw=0)
    ax.axvline(optimum[factor.name], color=ORANGE, lw=1.5)
    ax.set_yticks([])


def _pair(ax, row, column, draws, optimum):
    x, y = draws[column.name], draws[row.name]
    some = np.linspace(0, len(x) - 1, min(SHOWN, len(x))).astype(int)
    ax.scatter(x.iloc[some], y.iloc[some], s=6, color=BLUE, alpha=0.45, lw=0)
    ax.plot(optimum[column.name], optimum[row.name], "o", color="white", mec=ORANGE, mew=2, ms=7)
    ax.set_ylim(row.low, row.high)
    ax.set_title(f"correlation {fixed(np.corrcoef(x, y)[0, 1], 2, '+')}", fontsize=7)


def pushed_forward(
    means: np.ndarray, single: np.ndarray, measured: np.ndarray | Stated, response: Response = ANGLE
) -> Figure:
    """What the posterior expects of the target: of its mean and of a single run, beside the
    readings.

    means, single: (n,) draws; measured: readings (n,), or a `Stated` mean, drawn with its
    standard deviation.
    """
    figure, ax = subplots(size=(5.8, 3.4))
    ax.hist(single, BINS, density=True, color=GREY, alpha=0.35, label="a single run")
    ax.hist(means, BINS, density=True, color=BLUE, alpha=0.6, label="mean of many runs")
    if isinstance(measured, Stated):
        ax.errorbar(
            [measured.mean()], [0.0], xerr=[measured.std()], fmt="|", color=ORANGE, ms=14,
            label="measured, mean and sd", clip_on=False,
        )  # fmt: skip
    else:
        ax.plot(
            measured, np.zeros(len(measured)), "|", color=ORANGE, ms=14, label="readings",
            clip_on=False,
        )  # fmt: skip
    ax.axvline(measured.mean(), color=ORANGE, lw=1.5, label="their mean")
    ax.set(xlabel=response.axis, ylabel="density", yticks=[])
    ax.legend(frameon=False, fontsize=8)
    return figure


def next_measurements(table: pd.DataFrame) -> Figure:
    """What each further measurement is expected to leave of every parameter's standard deviation.

    table: rows `metric` and a column `<parameter> left` for each parameter, from 0 to 1.
    """
    columns = [c for c in table if c.endswith(" left")]
    names = [response_of(m).axis for m in table["metric"]]
    figure, ax = subplots(size=(6.4, 0.42 * len(names) + 1.3))
    y = np.arange(len(names))
    for k, column in enumerate(columns):
        shift = 0.8 * ((k + 0.5) / len(columns) - 0.5)
        ax.barh(
            y + shift, table[column], 0.8 / len(columns), label=label(column.removesuffix(" left")),
            color=(BLUE, GREEN, ORANGE, GREY)[k % 4],
        )  # fmt: skip
    ax.axvline(1.0, color="black", lw=1)
    ax.set_yticks(y, names, fontsize=8)
    ax.invert_yaxis()
    ax.set(xlim=(0.0, 1.05), xlabel="standard deviation left, expected, over that of today")
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    return figure
