"""Sizes out of what a laser diffraction instrument of the Mastersizer 2000 family exports as a
table.

The format is that of public exports and of a reader of them (github.com/paddy-r/PSD-Analyser). One
line of headings has `Result Between User Sizes (Sizes in um)`. Below it stand the limits of the
size classes [um], from that column on. Then each sample has a line, its name first. Below each
limit but the first stands the volume between it and the limit before [%].
"""

import math
from itertools import pairwise
from pathlib import Path

from calibration.errors import ConfigError
from calibration.intake.tables import read_rows

HEADING = "result between user sizes"
NAME = "sample name"
LEAST_SHARE = 0.5
"""Volume [%] of a class below which it is left out: tails of a fit, and grains without number."""


def mastersizer_sizes(path: str | Path) -> tuple[list[float], list[float]] | None:
    """(diameters [mm], volume shares [%]) of an export: the geometric mean of each class's limits.
    None for a table of another kind.

    Raises ConfigError where it holds several samples or cannot be read.
    """
    rows = read_rows(path)
    header = [cell.lower() for cell in rows[0][1]]
    column = next((k for k, cell in enumerate(header) if cell.startswith(HEADING)), None)
    if column is None:
        return None
    limits = [_number(path, line, cell) for line, cell in _filled(rows[1:2], column)]
    if len(limits) < 2 or any(b <= a for a, b in pairwise(limits)):
        allowed = "below it the limits of the classes in micrometres, ascending"
        raise ConfigError("has no size classes", path=path, column=rows[0][1][column],
                          allowed=allowed)  # fmt: skip
    line, cells = _one_sample(path, rows[2:], header)
    shares = [_number(path, line, c) for c in cells[column + 1 : column + len(limits)]]
    if len(shares) < len(limits) - 1:
        allowed = f"{len(limits) - 1}, one for each class"
        raise ConfigError("has too few shares", path=path, line=line, value=len(shares),
                          allowed=allowed)  # fmt: skip
    classes = [(math.sqrt(a * b), s) for (a, b), s in zip(pairwise(limits), shares, strict=True)]
    kept = [(round(1e-3 * d, 6), s) for d, s in classes if s >= LEAST_SHARE]
    if not kept:
        raise ConfigError("has no share in any class", path=path, line=line)
    # what is left out is shared out among the rest; what was missing before stays missing
    rest = sum(shares) / sum(s for _, s in kept)
    return [d for d, _ in kept], [rest * s for _, s in kept]


def _filled(rows, column):
    return [(line, cell) for line, cells in rows for cell in cells[column:] if cell]


def _one_sample(path, rows, header):
    """The one line of results. Raises ConfigError naming the samples where there are several."""
    at = header.index(NAME) if NAME in header else 0
    if len(rows) != 1:
        names = ", ".join(cells[at] for _, cells in rows) or "none"
        raise ConfigError(f"holds {len(rows)} samples ({names})", path=path,
                          allowed="an export of one, such as the averaged result")  # fmt: skip
    return rows[0]


def _number(path, line, cell):
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0:
        raise ConfigError("is no number", path=path, line=line, value=cell, allowed="0 or more")
    return value
