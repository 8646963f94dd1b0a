"""Which rig is well-posed: rates of the pour and speeds at which grains are made, that the paper
prints and does not print, at three points and by four readings of the same heap.

python -m paper.rigs OUT

The rule was stated before any of these runs (`results/reference/rigs/plan.md`). Runs that OUT holds
are not made again.
"""

import sys
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.files import write_table
from calibration.interface.api import Study
from calibration.study.config import overlay, point_spec
from dem.errors import DemError
from dem.measure.heap import LOWER, UPPER, fit_flank, outline
from dem.run import run
from dem.spec import parse_spec

C, E, G = "salt_steel_rolling_friction", "salt_salt_restitution", "salt_salt_rolling_friction"
POINTS = {
    "candidate": ({C: 0.368, E: 0.544, G: 0.23}, 4),  # the paper's optimum
    "low": ({C: 0.32, E: 0.6, G: 0.17}, 3),
    "high": ({C: 0.44, E: 0.3, G: 0.29}, 3),
}
"""Name: levels, and how many seeds. `low` and `high` are the corners of the paper's region with the
least and the greatest angle."""
RATES, SPEEDS = (10000, 6500), (0.3, 1.0, 2.0)  # [1/s], [m/s]
FIRST = 3501  # seed
KEYS = ["point", "generation_rate_per_s", "injection_speed_m_s"]
READINGS = ["angle_of_repose_deg", "one_flank_deg", "protractor_deg", "radial_angle_deg"]
TWO_KINDS = 2.0
"""Ratio of the most grains in a funnel at once from which on heaps are of two kinds."""
ALLOWED = 0.5
"""Degrees that the angle may move where a speed that the paper does not print goes to the next of
`SPEEDS`."""


def specs(study: Study) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Yield (row of the table, run spec) of every run, the points one after the other."""
    keys = {f.name: f.key for f in study.factors}
    for point, (levels, seeds) in POINTS.items():
        values = {keys[k]: v for k, v in (study.config.fixed | levels).items()}
        for seed, *rig in product(range(FIRST, FIRST + seeds), RATES, SPEEDS):
            changes = dict(zip(KEYS[1:], rig, strict=True))
            base = overlay(study.config.own_run, {"geometry": changes})
            row = {"point": point} | changes | {"seed": seed}
            yield row, point_spec(base, "heap", values, seed)


def readings(position: np.ndarray, radius: np.ndarray, plate_radius: float) -> dict[str, float]:
    """{reading: angle [°]} of a heap that lies still, by one flank of the first silhouette and by a
    protractor on both: the arm through the outline at 80 and 20 % of its height.

    position (n, 3), radius (n,), plate_radius : [m]
    """
    stations = np.arange(0.0, plate_radius, 0.25 * radius.mean())
    limit = plate_radius - radius.mean()
    laid, flanks = [], []
    for side in (1.0, -1.0):
        height = outline(side * position[:, 0], position[:, 2], radius, stations)
        flanks.append(fit_flank(stations, height, limit))
        inside = stations <= limit
        top = np.flatnonzero(inside & (height > UPPER * height.max()))[-1]
        below = np.flatnonzero(inside & (height < LOWER * height.max()))
        foot = next((k for k in below if k > top), np.flatnonzero(inside)[-1])
        fall, run_out = height[top] - height[foot], stations[foot] - stations[top]
        laid.append(np.degrees(np.arctan2(fall, run_out)))
    return {"one_flank_deg": float(flanks[0]), "protractor_deg": float(np.mean(laid))}


def _moves(runs, speed):
    """The largest change [°] of a reading from a speed to the next at any point where both have two
    runs or more, of the runs at one rate; NaN where there is none."""
    faster, found = dict(pairwise(SPEEDS)).get(speed), []
    for _, group in runs.groupby("point"):
        at = [group.loc[group[KEYS[2]] == v, READINGS].dropna() for v in (speed, faster)]
        if min(map(len, at)) > 1:
            found.append((at[1].mean() - at[0].mean()).abs().max())
    return max(found, default=np.nan)


def judged(table: pd.DataFrame) -> pd.DataFrame:
    """Table of the rigs by the plan's rule: rate, speed, least and most grains in a funnel at once,
    one_kind (all runs have a value, and these differ by less than TWO_KINDS), moves (the largest
    change of a reading to the next speed at any point [°], NaN at the last speed, which has none)
    and well_posed."""
    rows = []
    for (rate, speed), group in table.groupby(KEYS[1:]):
        held = group["hold_up"]
        complete = not group[[*READINGS, "hold_up"]].isna().to_numpy().any()
        moves = _moves(table[table[KEYS[1]] == rate], speed)
        one_kind = complete and held.max() < TWO_KINDS * held.min()
        row = {"rate": rate, "speed": speed, "least": held.min(), "most": held.max()}
        row |= {"one_kind": one_kind, "moves": moves}
        rows.append(row | {"well_posed": bool(one_kind and moves <= ALLOWED)})
    return pd.DataFrame(rows)


def chosen(rigs: pd.DataFrame) -> tuple[int, float]:
    """(rate, speed) by the plan's rule, of a table as of `judged`: the printed rate at its least
    well-posed speed, else the other rate at its, else the other rate at the speed, of those with
    one kind of heap, at which it moves least."""
    for rate in RATES:
        good = rigs.loc[(rigs["rate"] == rate) & rigs["well_posed"], "speed"]
        if len(good):
            return rate, float(good.min())
    slower = rigs[(rigs["rate"] == RATES[-1]) & rigs["one_kind"]]
    row = slower.dropna(subset="moves").sort_values("moves").iloc[0]
    return int(row["rate"]), float(row["speed"])


def main(out: str | Path, config: str | Path = "config") -> None:
    """Make what is missing of the runs and write OUT/runs.csv."""
    study, rows = Study(config), []
    plate = 0.5e-3 * study.config.own_run["geometry"]["plate_diameter_mm"]
    for row, spec in specs(study):
        folder = Path(out) / "_".join(map(str, row.values()))
        try:
            found = run(parse_spec(spec), folder, again=False)["metrics"]
        except DemError as error:
            print(f"{folder.name}: {error}")
            rows.append(row)
            continue
        with np.load(folder / "final.npz") as state:
            on = (state["position"][:, 2] > 0.0) & (state["position"][:, 2] < 1.5 * plate)
            own = readings(state["position"][on], state["radius"][on], plate)
        kept = ("angle_of_repose_deg", "radial_angle_deg", "hold_up")
        rows.append(row | {k: found[k] for k in kept} | own)
    write_table(pd.DataFrame(rows), Path(out) / "runs.csv")


if __name__ == "__main__":
    main(sys.argv[1])
