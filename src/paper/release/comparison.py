"""What `docs/evidence.md` says of the ways to calibrate, computed from the kept summary of
the comparison; `comparison.md.j2` has the words."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from paper.release.record import read_record

FOLDER = "comparison"
OTHERS = "libraries.csv"
"""The ways of libraries that are not installed here, as they were found when they were."""
CHAIN, SET = "paper's chain", "solution set of the chain"
FITTED, ADAPTIVE = "posterior, the chain's runs", "posterior, adaptive runs"
ENOUGH = 1.0 / 3.0
"""A third of the margin of 1 degree that the salt's validation asks for: decided before the ways
were tried."""
OPTIMISER, HISTORY = "Gaussian-process optimiser", "history matching"


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `comparison.md.j2`, from the folder of kept results."""
    folder = Path(kept) / FOLDER
    others = read_written(folder / OTHERS)
    made = read_record(Path(kept) / "release.json").get(FOLDER)
    own = read_written(folder / "summary.csv")
    every = pd.concat([own[~own["way"].isin(others["way"])], others])

    def of(responses, way, column, digits):
        """A column's values at the numbers of runs, in words; the least to the greatest of several
        ways."""
        ways = [way] if isinstance(way, str) else list(way)
        rows = every[(every["responses"] == responses) & every["way"].isin(ways)]
        each = [fixed(value, digits) for value in rows.sort_values("runs")[column].dropna()]
        return each if isinstance(way, str) else _range(each)

    return {
        "ways": list(dict.fromkeys(every["way"])),
        "enough": _enough(runs_needed(own[own["responses"] == "smooth"])),
        "of": of,
        "between": _range,
        "most": own["runs"].max(),
        "date": made.date if made else "a day that nobody recorded",
        "others_date": others["made"].max(),
        "chain": CHAIN, "set": SET, "fitted": FITTED, "adaptive": ADAPTIVE,
        "optimiser": OPTIMISER, "history": HISTORY,
    }  # fmt: skip


def _range(values):
    """ "low to high" of numbers as they are printed, or the one that all are."""
    ends = sorted(values, key=float)
    return ends[0] if ends[0] == ends[-1] else f"{ends[0]} to {ends[-1]}"


def _enough(needed):
    """[(runs or None, ways that need so many)], the fewest first, those that need more last."""
    groups: dict[int | None, list[str]] = {}
    for way, runs in needed.items():
        groups.setdefault(runs, []).append(way)
    return sorted(groups.items(), key=lambda group: group[0] or math.inf)


def runs_needed(found: pd.DataFrame) -> dict[str, int | None]:
    """Return {way: fewest runs whose error is at most ENOUGH, or None}."""
    good = found[found["rmse"] <= ENOUGH]
    ways = dict.fromkeys(found["way"])
    return {way: _first(good.loc[good["way"] == way, "runs"]) for way in ways}


def _first(runs):
    return int(runs.min()) if len(runs) else None
