"""The paper's tables of simulated values, made with EDEM: what was run, and at which levels."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from paper.audit.paper import NAMES, Paper


@dataclass(frozen=True)
class Table:
    """A table of simulated values: the experiment, its file, the column of the values, their
    unit."""

    experiment: str
    file: str
    column: str
    unit: str


TABLES = {
    "Table 6": Table("heap", "table06_plackett_burman", "angle_deg", "deg"),
    "Table 8": Table("tilt", "table08_inclined_plane", "angle_deg", "deg"),
    "Table 9": Table("drop", "table09_drop_test", "rebound_height_mm", "mm"),
    "Table 10": Table("heap", "table10_steepest_ascent", "angle_deg", "deg"),
    "Table 11": Table("heap", "table11_box_behnken", "angle_deg", "deg"),
}


def levels(paper: Paper, item: str) -> pd.DataFrame:
    """The factors' levels of a table's rows, in natural units."""
    table = TABLES[item]
    if item == "Table 6":
        ranges = paper.keyed("table05_contact_parameter_ranges", "factor", "low", "high")
        names = paper.text("table05_contact_parameter_ranges", "name")["name"]
        return _natural(paper.numbers(table.file, *ranges.index), ranges).set_axis(names, axis=1)
    if table.experiment != "heap":
        own = [c for c in paper.text(table.file) if c not in ("number", table.column)]
        return paper.numbers(table.file, *own)
    found = paper.numbers(table.file, *NAMES)
    if item == "Table 11":
        found = _natural(found, paper.keyed("table11_coding", "factor", "low", "high"))
    return found.rename(columns=NAMES)


def _natural(coded, ranges):
    """Coded levels in natural units; ranges: low and high of each column."""
    low, high = ranges["low"], ranges["high"]
    return np.round(0.5 * (low + high) + 0.5 * coded * (high - low), 9)
