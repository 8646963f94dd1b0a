"""What the pages' templates cannot compute by themselves, from the kept results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from calibration.engines.templates import macros
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.stages.screening import aliasing
from calibration.statistics.screening import screen
from calibration.study.factors import read_factors
from calibration.telling.export.decks import NAMES
from paper.audit.paper import Paper
from paper.audit.screening import screened
from paper.reproduction.chain import CODES as FACTORS
from paper.reproduction.chain import own_half

PACKED = 1250
"""Most grains in the funnel at once [-] above which a pour of the paper's rig has packed: the two
kinds of pours lie hundreds of grains apart on either side of it."""
SEEDS = {1: "salt", 2: "salt-2", 3: "salt-3", 4: "salt-4"}
"""{seed: kept study} of the screening at other seeds."""
STIFFER = "full scale, shear modulus 10 MPa"
"""Variant of the study of the numerics."""
ENOUGH = 1.0 / 3.0
"""A third of the margin of 1 degree that the salt's validation asks for: decided before the ways
were tried."""
CODES = {"dem": "this engine", **NAMES}
"""{code: its name in words}."""
FALL, GRAIN = "penetration-25K", 1e-3
"""Case of the bulk processes whose falls are compared, and the radius of its bed's grains [m]."""
END = 0.04
"""Time of the last look at a fall [s]."""
STARTS = {
    unit: ("dem", *(f"dem-moved-{k}-{short}" for k in (1, 2, 3, 4)))
    for unit, short in (("nanometres", "nm"), ("micrometres", "um"), ("tenths of a mm", "0.1mm"))
}
"""Runs of this engine whose starts differ by one to four of a unit: what chance makes of a fall."""


# --- the paper's results ------------------------------------------------------------------------


def said(name: str, *given: Any) -> str:
    """The text of a macro of `said.j2`, in one line."""
    return " ".join(getattr(macros("paper.release", "said"), name)(*given).split())


def funnels(kept: Path) -> dict[str, Any]:
    """How many runs packed the funnel, by how much their heaps are steeper where others did not
    (None elsewhere), and the numbers of the screening's runs without a value."""
    table = read_written(kept / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna(subset=["angle_of_repose_deg", "hold_up"])
    packed, steeper = runs["hold_up"] > PACKED, None
    if packed.any() and not packed.all():
        steep, flat = (runs.loc[k, "angle_of_repose_deg"] for k in (packed, ~packed))
        error = np.hypot(steep.std() / np.sqrt(len(steep)), flat.std() / np.sqrt(len(flat)))
        steeper = f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°"
    screened = read_written(kept / "screening" / "runs.csv")
    lost = sorted(map(int, screened.loc[screened["response"].isna(), "run"]))
    return {"runs": len(runs), "packed": int(packed.sum()), "steeper": steeper, "lost": lost}


def off_the_paper(effects: pd.DataFrame) -> float:
    """Root mean square [deg] of the differences of a study's effects, by code, from the paper's."""
    printed = screened(Paper("data/paper")).table.set_index("code")["effect"]
    return float(np.sqrt(((effects["effect"] - printed) ** 2).mean()))


def other_seeds(kept: Path) -> dict[str, Any]:
    """The screening at all of SEEDS together: the paper's rows, and with the foldover where it was
    run (`folded`)."""
    runs = [read_written(kept / name / "screening" / "runs.csv") for name in SEEDS.values()]
    paper, whole = pd.concat(map(own_half, runs)), pd.concat(runs)
    return _together(paper) | {"folded": _together(whole) if len(whole) > len(paper) else None}


def _together(runs):
    """How many heaps all runs of a screening's rows are, the effects that their pure error shows,
    and the most interactions of which one carries a part."""
    runs = runs.dropna(subset="response")
    table = screen(runs, FACTORS, runs["response"]).table.set_index("code")
    there = table[table["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
    aliases = aliasing(runs, FACTORS)["aliases"].values()
    return {"heaps": len(runs), "carried": max(map(len, aliases), default=0), "found": there}


def by_all_tests(kept: Path) -> list[dict[str, Any]]:
    """A mapping a factor of the salt: name, levels, interval by the heap `alone`, or None and what
    it is `held` at, interval by `all` tests, and whether these bound it."""
    found = {p["key"]: p for p in read_json(kept / "salt-atlas" / "answer.json")["parameters"]}
    alone = read_written(kept / "salt" / "posterior" / "parameters.csv").set_index("parameter")
    held = yaml.safe_load(Path("config/config.yaml").read_text("utf-8"))["fixed"]
    rows = []
    for f in read_factors("config/factors.tsv"):
        row = {"name": f.name, "levels": (f.low, f.high), "held": held.get(f.name), "alone": None}
        if f.name in alone.index:
            row["alone"] = tuple(alone.loc[f.name, ["low", "high"]])
        rows.append(row | {"all": found[f.key]["interval_95"], "bounded": found[f.key]["bounded"]})
    return rows


def softening(table: pd.DataFrame) -> str:
    """Return what softening the grains to 3 MPa changes at full scale, in sentences, of the table
    of the study of the numerics: at each point, and over all of them with Welch's 95 % interval."""
    stiff = table[table["variant"] == STIFFER].set_index("point")
    soft = table[table["variant"] == stiff["against"].iloc[0]].set_index("point").loc[stiff.index]
    parts = np.concatenate([t["sd"] ** 2 / t["n"] for t in (stiff, soft)]) / len(stiff) ** 2
    counts = np.concatenate([stiff["n"], soft["n"]])
    freedom = parts.sum() ** 2 / (parts**2 / (counts - 1)).sum()
    half, mean = stats.t.ppf(0.975, freedom) * np.sqrt(parts.sum()), stiff["difference"].mean()
    return said("softening", list(stiff.itertuples()), mean, half)


# --- evidence and other codes -------------------------------------------------------------------


def ways(kept: Path) -> pd.DataFrame:
    """The comparison of ways to calibrate, a row a kind of responses, a way and a number of runs.
    The ways of libraries that are not installed here stand as they were found when they were."""
    own, others = (read_written(kept / f"{name}.csv") for name in ("summary", "libraries"))
    every = pd.concat([own[~own["way"].isin(others["way"])], others])
    return every.sort_values("runs", kind="stable")


def enough(found: pd.DataFrame) -> list[tuple[int | None, list[str]]]:
    """[(fewest runs whose error is at most ENOUGH, or None; the ways that need so many)], the
    fewest first."""
    good = found[found["rmse"] <= ENOUGH].groupby("way")["runs"].min()
    groups: dict[int | None, list[str]] = {}
    for way in dict.fromkeys(found["way"]):
        groups.setdefault(int(good[way]) if way in good else None, []).append(way)
    return sorted(groups.items(), key=lambda group: group[0] or math.inf)


def falls(kept: Path) -> dict[str, pd.Series]:
    """{code: height [m] over time [s] of the sphere that falls into a bed}."""
    runs = read_written(kept / "runs.csv")
    return {
        code: read_written(kept / f"{FALL}.{code}.csv").set_index("time_s")["height_m"]
        for code in runs.loc[runs["case"] == FALL, "code"]
    }


def _at(fall, time):
    """Height at the look nearest to a time."""
    return fall.iloc[abs(fall.index - time).argmin()]


def apart(ours: pd.Series, fall: pd.Series) -> tuple[float, float]:
    """Largest distance of a code's sphere from ours at a common look, on the way down and at any,
    in radii of a grain."""
    looks = fall.index[fall.index <= ours.index.max() + 1e-9]
    off = [abs(_at(ours, look) - fall[look]) / GRAIN for look in looks]
    down = [d for d, look in zip(off, looks, strict=True) if look < ours.idxmin()]
    return max(down), max(off)


def chances(kept: Mapping[str, pd.Series], fall: pd.Series) -> list[float]:
    """p of another code's last height as one more of the starts' (t test of one new value), for
    each of STARTS of which more than two are kept."""
    found = []
    for own in STARTS.values():
        ends = np.array([_at(kept[code], END) for code in own if code in kept])
        if len(ends) > 2:
            error = ends.std(ddof=1) * math.sqrt(1.0 + 1.0 / len(ends))
            off = abs(_at(fall, END) - ends.mean()) / error
            found.append(float(2.0 * stats.t.sf(off, len(ends) - 1)))
    return found
