"""The response surface and its diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import scipy

from calibration.figures.labels import ANGLE, label
from calibration.figures.planes import label_3d, pairs_of, plane
from calibration.figures.style import BLUE, GREY, panel_grid, styled, subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response
    from calibration.statistics.factor import CodedFactor
    from calibration.statistics.surface import Surface


def predicted_actual(surface: Surface, response: Response = ANGLE) -> Figure:
    """Predicted against simulated response."""
    figure, ax = subplots(size=(4.2, 4.0))
    d = surface.diagnostics
    ax.scatter(d["actual"], d["predicted"], color=BLUE)
    ends = [
        min(d["actual"].min(), d["predicted"].min()),
        max(d["actual"].max(), d["predicted"].max()),
    ]
    ax.plot(ends, ends, color=GREY, lw=1)
    unit = response.brackets
    ax.set(
        xlabel=f"simulated {response.name}{unit}",
        ylabel=f"predicted by the quadratic model{unit}",
        aspect="equal",
    )
    return figure


def residual_panel(surface: Surface, response: Response = ANGLE) -> Figure:
    """Normal plot of residuals, residuals against prediction and run, and Cook's distance."""
    d = surface.diagnostics
    figure, ax = subplots(2, 2, size=(7.2, 5.8))
    z = np.sort(d["externally_studentised"])
    q = scipy.stats.norm.ppf((np.arange(1, len(z) + 1) - 0.5) / len(z))
    ax[0, 0].scatter(z, q, color=BLUE)
    ax[0, 0].plot(q, q, color=GREY, lw=1)
    ax[0, 0].set(xlabel="externally studentised residual", ylabel="normal quantile")
    for panel, x, name in (
        (ax[0, 1], d["predicted"], f"predicted{response.brackets}"),
        (ax[1, 0], d["run"], "run"),
    ):
        panel.scatter(x, d["externally_studentised"], color=BLUE)
        limit = scipy.stats.t.ppf(1 - 0.025 / len(d), max(surface.df - 1, 1))
        for y in (-limit, 0, limit):
            panel.axhline(y, color=GREY, lw=1, ls="-" if y == 0 else "--")
        panel.set(xlabel=name, ylabel="externally studentised residual")
    ax[1, 1].vlines(d["run"], 0, d["cooks_distance"], color=BLUE)
    ax[1, 1].axhline(1.0, color=GREY, lw=1, ls="--")
    ax[1, 1].set(xlabel="run", ylabel="Cook's distance")
    return figure


def perturbation(
    surface: Surface, region: Sequence[CodedFactor], response: Response = ANGLE
) -> Figure:
    """Response along each factor with the others at the centre."""
    figure, ax = subplots()
    x = np.linspace(-1, 1, 81)
    for k, factor in enumerate(region):
        levels = np.zeros((len(x), len(region)))
        levels[:, k] = x
        ax.plot(x, surface.predict(levels), label=f"{factor.code}  {label(factor.name)}")
    ax.set(xlabel="distance from the centre, coded", ylabel=response.axis)
    ax.legend(frameon=False)
    return figure


def surfaces(surface: Surface, region: Sequence[CodedFactor], response: Response = ANGLE) -> Figure:
    """Response surfaces of all pairs of factors, the others at the centre."""
    pairs = pairs_of(region)
    with styled():
        figure, rows, columns = panel_grid(len(pairs), (3.9, 3.6))
        for n, (i, j) in enumerate(pairs):
            ax = figure.add_subplot(rows, columns, n + 1, projection="3d")
            a, b, levels = plane(region, i, j, resolution=31)
            y = surface.predict(levels).reshape(a.shape)
            # some thousand faces: as an image they weigh a tenth, and the words stay words
            ax.plot_surface(a, b, y, cmap="viridis", alpha=0.9, rasterized=True)
            label_3d(ax, label(region[i].name), label(region[j].name), response.axis)
    return figure
