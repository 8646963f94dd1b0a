"""The look of all figures, and how one is written.

The figures keep their own white ground, so that they read the same on light and dark pages.
matplotlib, which takes a second to load, is loaded when the first one is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

from calibration.files import replacing

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure


BLUE, ORANGE, GREY, GREEN = "#2f6db5", "#d1711f", "#8a8f98", "#2e8b57"


STYLE = {
    "figure.facecolor": "white",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.25,
    "font.size": 10,
    "axes.titlesize": 11,
    "svg.fonttype": "none",
    "svg.hashsalt": "granular-calibration",
}
LINES = {
    "color": [BLUE, ORANGE, GREEN, "#7b4fa3", "#b5363f", "#5b7a1f", GREY],
    "linestyle": ["-", "--", "-.", ":", "-", "--", "-."],
}


@cache
def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt


@contextmanager
def styled() -> Iterator[Any]:
    """Draw in the style of all figures, by `matplotlib.pyplot`, which is given."""
    import matplotlib

    plt = _pyplot()
    cycle = {"axes.prop_cycle": matplotlib.cycler(**LINES)}  # type: ignore[attr-defined]
    with plt.rc_context(STYLE | cycle):  # type: ignore[arg-type]  # names of matplotlib
        yield plt


def subplots(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (5.4, 3.8), **more: Any
) -> tuple[Figure, Any]:
    """`matplotlib.pyplot.subplots` in the style of all figures; size: inches."""
    with styled() as plt:
        return plt.subplots(rows, columns, figsize=size, layout="constrained", **more)


def panel_grid(count: int, size: tuple[float, float]) -> tuple[Figure, int, int]:
    """Figure and rows, columns of a grid of `count` panels, two a row so that they read on a narrow
    page; size: inches of one. Called where one is `styled`."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = _pyplot().figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    return figure, rows, columns


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure to `path` (.svg or .png) and close it."""
    with replacing(path) as partial, styled() as plt:
        metadata = {"Date": None} if partial.suffix == ".svg" else None
        figure.savefig(partial, dpi=150, metadata=metadata)
        plt.close(figure)
