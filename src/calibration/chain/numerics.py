"""What the numerical choices cost: the same points with other resolutions, time steps, moduli and
rolling laws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from calibration import figures
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, together, write_plan
from calibration.study.config import overlay

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study


def plan_numerics(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan every variant at every point with every seed."""
    wanted = yaml.safe_load(Path(source.variants).read_text())
    parts = []
    for name, variant in wanted["variants"].items():
        rows = [
            {"variant": name, "against": variant.get("against", ""), "point": point} | levels
            for point, levels in wanted["points"].items()
            for _ in range(variant.get("seeds", wanted["seeds"]))
        ]
        run = overlay(study.config.run, variant["run"])
        parts.append(study.plan(pd.DataFrame(rows), run=run))
    write_plan(Path(output.plan).parent, *together(parts))


def compare_variants(design: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Table: variant, against, point, n (runs with a value), without_value (runs without), mean,
    sd, difference, low, high (95 % Welch interval), within_seed_spread. What too few values tell is
    NaN."""
    design = design.assign(response=read_values(design["run_id"], metric))
    rows = []
    for (name, point), group in design.groupby(["variant", "point"], sort=False):
        ours, against = group["response"].dropna(), group["against"].iloc[0]
        row = {"variant": name, "against": against, "point": point, "n": len(ours)}
        row |= {"without_value": len(group) - len(ours)}
        row |= {"mean": ours.mean(), "sd": ours.std()}
        if isinstance(against, str) and against:
            other = (design["variant"] == against) & (design["point"] == point)
            row |= _difference(ours, design.loc[other, "response"].dropna())
        rows.append(row)
    return pd.DataFrame(rows)


def _difference(ours, theirs):
    """Of the means of two samples (series); NaN where one has fewer than two values."""
    if min(len(ours), len(theirs)) < 2:
        return dict.fromkeys(("difference", "low", "high", "seed_sd"), np.nan)
    low, high = stats.ttest_ind(ours, theirs, equal_var=False).confidence_interval(0.95)
    spread = float(np.sqrt((ours.var() + theirs.var()) / 2))
    difference = ours.mean() - theirs.mean()
    row = {"difference": difference, "low": low, "high": high, "seed_sd": spread}
    return row | {"within_seed_spread": bool(abs(difference) < spread)}


def numerics(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write the table of differences and its figure."""
    metric = study.config.target.metric
    table = compare_variants(read_written(source.design), metric).round(3)
    write_table(table, output.table)
    figures.save(figures.numerics(table, figures.response_of(metric)), output.figure)
