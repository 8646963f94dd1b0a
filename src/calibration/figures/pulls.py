"""Every measured value beside what the parameters handed out give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calibration.figures.style import BLUE, GREY, ORANGE, subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SHADE = 2.0
"""Standard errors of the band."""


def pulls(rows: Sequence[tuple[str, float, bool]]) -> Figure:
    """The pull of each judged row beside a band of two standard errors; rows: (name, pull, whether
    it is missed), the first on top."""
    figure, ax = subplots(size=(6.4, 0.9 + 0.34 * max(len(rows), 1)))
    ax.axvspan(-SHADE, SHADE, color=BLUE, alpha=0.1, lw=0)
    ax.axvline(0.0, color=GREY, lw=1.0)
    for k, (_, pull, missed) in enumerate(rows):
        ax.plot([0.0, pull], [k, k], color=ORANGE if missed else BLUE, lw=2.0, ls="-")
        ax.plot(pull, k, "o", color=ORANGE if missed else BLUE)
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.invert_yaxis()
    ax.margins(y=0.15)
    ax.set_xlabel("measured less predicted, in standard errors")
    return figure
