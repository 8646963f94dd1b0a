"""What the draws of the posterior give in other machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calibration.figures.labels import label, response_of
from calibration.figures.style import BLUE, ORANGE, panel_grid, styled, subplots

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def pushed_through(rows: Sequence[tuple[Mapping[str, Any], pd.DataFrame]]) -> Figure:
    """Each metric of each machine over the parameter that decides it, with the interval of a
    further run and what was measured.

    rows: (row of the stage's table, table of the machine's runs), one a panel.
    """
    if not rows:
        figure, ax = subplots(size=(4.0, 1.0))
        ax.set_axis_off()
        ax.text(0.5, 0.5, "no run gave a value", ha="center")
        return figure
    with styled():
        figure, down, across = panel_grid(len(rows), (4.1, 3.2))
        for n, (row, table) in enumerate(rows):
            _panel(figure.add_subplot(down, across, n + 1), row, table)
    return figure


def _panel(ax, row, table):
    over = row["decides"] or "draw"
    ax.scatter(table[over], table[row["metric"]], s=14, color=BLUE, alpha=0.7)
    ax.axhspan(row["low"], row["high"], color=BLUE, alpha=0.1, lw=0)
    if row["measured"] is not None:
        ax.axhline(row["measured"], color=ORANGE, lw=1.8, label="measured")
        ax.legend(frameon=False, fontsize=8)
    ax.set(xlabel=label(over), ylabel=response_of(row["metric"]).axis)
    ax.set_title(label(row["machine"]), fontsize=9)
