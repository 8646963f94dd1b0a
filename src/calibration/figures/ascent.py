"""The path of steepest ascent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.figures.labels import ANGLE, label
from calibration.figures.style import BLUE, ORANGE, subplots

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response
    from calibration.statistics.factor import CodedFactor


def ascent_path(
    runs: pd.DataFrame,
    factors: Sequence[CodedFactor],
    target: float,
    best: int,
    response: Response = ANGLE,
) -> Figure:
    """Response along the path with the target."""
    figure, ax = subplots()
    ax.errorbar(
        runs["run"],
        runs["response"],
        yerr=runs.get("response_sd"),
        color=BLUE,
        marker="o",
        capsize=3,
    )
    ax.axhline(target, color=ORANGE, lw=1.2, label=f"measured {response.value(target)}")
    row = runs[runs["run"] == best].iloc[0]
    ax.scatter(
        [best],
        [row["response"]],
        s=140,
        facecolor="none",
        edgecolor=ORANGE,
        zorder=3,
        label="centre of the region",
    )
    names = ["\n".join(f"{r[f.name]:.3g}" for f in factors) for _, r in runs.iterrows()]
    ax.set_xticks(runs["run"], names)
    ax.set(
        ylabel=response.axis,
        xlabel="\n".join(f"{i + 1}. line: {label(f.name)}" for i, f in enumerate(factors)),
    )
    ax.legend(frameon=False)
    return figure
