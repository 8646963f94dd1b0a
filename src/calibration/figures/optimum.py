"""The optimum among all points that give the target, or nearly as desirable a compromise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from calibration.figures.labels import ANGLE, label, response_of
from calibration.figures.planes import pairs_of, plane
from calibration.figures.style import BLUE, ORANGE, panel_grid, styled, subplots
from calibration.statistics.goals import overall_desirability

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response
    from calibration.statistics.factor import CodedFactor
    from calibration.statistics.goals import Goal
    from calibration.statistics.optimise import Compromise, Solution
    from calibration.statistics.surface import Surface


LINES = ("#d1711f", "#2f6db5", "#7b4fa3", "#b5363f", "#5b7a1f")  # of the targets, in their order


def contours(
    surface: Surface, region: Sequence[CodedFactor], solution: Solution, response: Response = ANGLE
) -> Figure:
    """Contours through the chosen point with the solution set drawn in."""
    pairs = pairs_of(region)
    with styled():
        figure, rows, columns = panel_grid(len(pairs), (4.1, 3.5))
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1)
            _contour(ax, surface, region, i, j, solution, response)
    return figure


def _contour(ax, surface, region, i, j, solution, response):
    a, b, levels = plane(region, i, j, at=solution.chosen)
    y = surface.predict(levels).reshape(a.shape)
    filled = ax.contourf(a, b, y, 12, cmap="viridis", alpha=0.85)
    ax.figure.colorbar(filled, ax=ax, label=response.axis, shrink=0.9)
    if y.min() < solution.target < y.max():
        ax.contour(a, b, y, [solution.target], colors="white", linewidths=4.5)
        ax.contour(a, b, y, [solution.target], colors=ORANGE, linewidths=2.5)
    x, z = (region[k].natural(float(solution.chosen[k])) for k in (i, j))
    ax.plot(x, z, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    ax.set(xlabel=label(region[i].name), ylabel=label(region[j].name))
    ax.grid(False)


def desirability_contours(
    surfaces: Sequence[Surface],
    goals: Sequence[Goal],
    region: Sequence[CodedFactor],
    found: Compromise,
) -> Figure:
    """Overall desirability over each pair of factors, with the others at the chosen point. A line
    shows where a response meets its target. surfaces and goals have the same order; found:
    `Compromise`. Returns a matplotlib Figure."""
    pairs = pairs_of(region)
    with styled():
        figure, rows, columns = panel_grid(len(pairs), (4.8, 4.0))
        for n, pair in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1)
            _desirability(ax, surfaces, goals, region, pair, found)
    return figure


def front(
    table: pd.DataFrame,
    metrics: Sequence[str],
    targets: Sequence[float | None],
    chosen: Sequence[float],
) -> Figure:
    """Two responses along their Pareto front, with the chosen compromise; a line at a target.

    table: the responses in columns of their metrics; targets: of each, or None; chosen: both
    responses at the optimum. Returns a matplotlib Figure.
    """
    figure, ax = subplots(size=(5.2, 3.8))
    first, second = (response_of(m) for m in metrics)
    ax.plot(table[metrics[0]], table[metrics[1]], ".", color=BLUE, label="no point beats these")
    ax.plot(*chosen, "o", color="white", mec="black", ms=9, label="most desirable")
    for draw, target in zip((ax.axvline, ax.axhline), targets, strict=True):
        if target is not None:
            draw(target, color=ORANGE, lw=1.2)
    ax.set(xlabel=first.axis, ylabel=second.axis)
    ax.legend(frameon=False, fontsize=8)
    return figure


def _desirability(ax, surfaces, goals, region, pair, found):
    i, j = pair
    x, y, levels = plane(region, i, j, at=found.chosen)
    overall = overall_desirability(surfaces, goals, levels).reshape(x.shape)
    filled = ax.contourf(x, y, overall, np.linspace(0.0, 1.0, 11), cmap="Greens", alpha=0.85)
    ax.figure.colorbar(filled, ax=ax, label="overall desirability", shrink=0.9)
    for n, (surface, goal) in enumerate(zip(surfaces, goals, strict=True)):
        if goal.target is None:
            continue
        response = surface.predict(levels).reshape(x.shape)
        if response.min() < goal.target < response.max():
            colour = LINES[n % len(LINES)]
            drawn = ax.contour(x, y, response, [goal.target], colors=colour, linewidths=2.0)
            ax.clabel(drawn, fmt=f"target {n + 1}: %.4g", fontsize=8)
    at = [region[k].natural(float(found.chosen[k])) for k in pair]
    ax.plot(*at, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    ax.set(xlabel=label(region[i].name), ylabel=label(region[j].name))
    ax.grid(False)
