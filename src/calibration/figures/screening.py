"""The screening's charts of effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from calibration.figures.labels import ANGLE, label
from calibration.figures.style import BLUE, GREY, ORANGE, subplots

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response


def half_normal(table: pd.DataFrame, chosen: Sequence[str], response: Response = ANGLE) -> Figure:
    """Half-normal plot of absolute effects; `chosen` codes stand out."""
    figure, ax = subplots()
    size, score = table["effect"].abs(), table["half_normal_score"]
    picked = table["code"].isin(chosen)
    ax.scatter(size[~picked], score[~picked], color=GREY, label="stays at its level")
    ax.scatter(size[picked], score[picked], color=ORANGE, label="goes on")
    for e, s, code, name in zip(size, score, table["code"], table["name"], strict=True):
        text = f"{code}  {label(name)}" if code in chosen else code
        ax.annotate(text, (e, s), xytext=(6, -3), textcoords="offset points", fontsize=9)
    small = ~picked if (~picked).any() else picked
    slope = float((score[small] * size[small]).sum() / (size[small] ** 2).sum())
    line = np.array([0.0, float(score.max()) / slope])
    ax.plot(line, slope * line, color=GREY, lw=1)
    ax.set(
        xlabel=f"|effect|{response.brackets}",
        ylabel="half-normal quantile",
        xlim=(0, 1.45 * size.max()),
        ylim=(0, 1.15 * score.max()),
    )
    ax.legend(loc="lower right", frameon=False)
    return figure


def pareto(
    table: pd.DataFrame,
    t_limit: float,
    bonferroni_limit: float,
    alpha: float = 0.05,
    response: Response = ANGLE,
) -> Figure:
    """Pareto chart of absolute effects with the limits of significance at level alpha."""
    from matplotlib.patches import Patch

    figure, ax = subplots()
    order = table.reindex(table["effect"].abs().sort_values().index)
    colour = np.where(order["effect"] > 0, BLUE, ORANGE)
    names = [f"{label(n)}  {c}" for n, c in zip(order["name"], order["code"], strict=True)]
    ax.barh(names, order["effect"].abs(), color=colour)
    ax.axvline(t_limit, color="black", lw=1, ls="--")
    ax.axvline(bonferroni_limit, color="black", lw=1, ls=":")
    for x, text in (
        (t_limit, f"t limit {100 * alpha:g} %"),
        (bonferroni_limit, f"Bonferroni {100 * alpha:g} %"),
    ):
        ax.annotate(
            text,
            (x, 0),
            xytext=(3, -2),
            textcoords="offset points",
            rotation=90,
            fontsize=8,
            va="bottom",
        )
    ax.set(xlabel=f"|effect|{response.brackets}")
    # below the whole figure: a line under the axis would be centred on it and cut off beside it
    ways = {BLUE: f"raises the {response.name}", ORANGE: "lowers it"}
    figure.legend(
        handles=[Patch(color=colour, label=words) for colour, words in ways.items()],
        loc="outside lower center", ncols=2, frameon=False, fontsize=9,
    )  # fmt: skip
    return figure
