"""Replicates at the optimum beside the measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calibration.figures.labels import ANGLE
from calibration.figures.style import BLUE, ORANGE, subplots
from calibration.statistics.stated import Stated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response
    from calibration.statistics.validate import Comparison


def validation(
    groups: np.ndarray,
    measured: np.ndarray | Stated,
    result: Comparison,
    response: Response = ANGLE,
) -> Figure:
    """Replicates by group beside the measurement, with means and the equivalence margin. measured:
    readings (n,), or a `Stated` mean, which is drawn with its standard deviation."""
    figure, ax = subplots()
    for g, values in enumerate(groups):
        ax.scatter(np.full(len(values), g + 1), values, color=BLUE, alpha=0.7)
        ax.hlines(values.mean(), g + 0.75, g + 1.25, color=BLUE, lw=2)
    place = len(groups) + 1.5
    if isinstance(measured, Stated):
        ax.errorbar([place], [measured.mean()], [measured.std()], color=ORANGE, alpha=0.7)
    else:
        jitter = np.linspace(-0.2, 0.2, len(measured))
        ax.scatter(place + jitter, measured, color=ORANGE, alpha=0.7)
    ax.hlines(measured.mean(), place - 0.35, place + 0.35, color=ORANGE, lw=2)
    ax.axhspan(
        measured.mean() - result.margin,
        measured.mean() + result.margin,
        color=ORANGE,
        alpha=0.12,
        lw=0,
    )
    ax.axhline(result.simulated_mean, color=BLUE, lw=1, ls="--")
    ax.set_xticks(
        [*range(1, len(groups) + 1), place],
        [*(f"group {g + 1}" for g in range(len(groups))), "measured"],
    )
    simulated, aim = (response.value(v) for v in (result.simulated_mean, result.measured_mean))
    means = f"simulated {simulated}, measured {aim}"
    ax.set(ylabel=response.axis, title=f"{means}: {result.relative_error_percent:.2f} % apart")
    return figure
