"""The figure of several targets at once: overall desirability with every target's own line."""

import matplotlib.pyplot as plt
import numpy as np

from calibration.figures import STYLE, label
from calibration.goals import overall_desirability

RESOLUTION = 61
LINES = ("#d1711f", "#2f6db5", "#7b4fa3", "#b5363f", "#5b7a1f")


def desirability_contours(surfaces, goals, region, found):
    """Overall desirability over each pair of factors, the others at the chosen point; a line where a response meets
    its target. surfaces and goals in the same order; found: `Compromise`. Returns a matplotlib Figure."""
    pairs = [(i, j) for i in range(len(region)) for j in range(i + 1, len(region))]
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(4.8 * columns, 4.0 * rows), layout="constrained")
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1)
            _panel(ax, surfaces, goals, region, (i, j), found)
    return figure


def _panel(ax, surfaces, goals, region, pair, found):
    i, j = pair
    line = np.linspace(-1.0, 1.0, RESOLUTION)
    a, b = np.meshgrid(line, line)
    levels = np.tile(found.chosen, (a.size, 1))
    levels[:, i], levels[:, j] = a.ravel(), b.ravel()
    x, y = region[i].natural(a), region[j].natural(b)
    overall = overall_desirability(surfaces, goals, levels).reshape(a.shape)
    filled = ax.contourf(x, y, overall, np.linspace(0.0, 1.0, 11), cmap="Greens", alpha=0.85)
    ax.figure.colorbar(filled, ax=ax, label="overall desirability", shrink=0.9)
    for n, (surface, goal) in enumerate(zip(surfaces, goals, strict=True)):
        if goal.target is None:
            continue
        response = surface.predict(levels).reshape(a.shape)
        if response.min() < goal.target < response.max():
            colour = LINES[n % len(LINES)]
            drawn = ax.contour(x, y, response, [goal.target], colors=colour, linewidths=2.0)
            ax.clabel(drawn, fmt=f"target {n + 1}: %.4g", fontsize=8)
    at = [region[k].natural(float(found.chosen[k])) for k in pair]
    ax.plot(*at, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    ax.set(xlabel=label(region[i].name), ylabel=label(region[j].name))
    ax.grid(False)
