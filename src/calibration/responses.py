"""Responses of a study: which metric of the runs each is, which factors matter to any, and which
point is nearest."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd

from calibration.campaign import read_metric
from calibration.config import goals, read_target
from calibration.errors import CalibrationError
from calibration.statistics.goals import combined_desirability


def columns(config):
    """{column of the design tables: metric}; the target's is `response`, the others bear their
    metric's name."""
    return {"response": config.target.metric} | {t.metric: t.metric for t in config.further_targets}


def with_responses(design, config):
    """The design table (pandas) with the metrics of its finished runs in `columns`. `response_sd`
    has the spread within a run, if the target's metric has one.

    A run that finished without the metric, as a heap that is no heap does, has NaN there.
    """
    design = design.copy()
    for column, metric in columns(config).items():
        values = read_metric(design["run_id"], metric, None)
        design[column] = [np.nan if value is None else float(value) for value in values]
    spread = read_metric(design["run_id"], spread_of(config.target.metric), None)
    if all(value is not None for value in spread):
        design["response_sd"] = spread
    return design


def with_value(runs, column):
    """The rows of a table that have a value in `column`, numbered anew. Raises CalibrationError
    where fewer than two have one."""
    here = runs[runs[column].notna()].reset_index(drop=True)
    if len(here) < 2:
        raise CalibrationError(
            f"{len(here)} of {len(runs)} runs have a value of {column}; nothing can be fitted to "
            f"them"
        )
    return here


def without_response(runs):
    """Numbers of the runs that finished without a response."""
    return [int(n) for n in runs.loc[runs["response"].isna(), "run"]]


def spread_of(metric):
    """Name of the metric that holds the spread of another within a run: `_sd` before the unit."""
    return re.sub(r"_([^_]+)$", r"_sd_\1", metric)


def strongest(screenings):
    """One screening for several responses: each factor with the response that it moves most for its
    error.

    screenings: `Screening` of each response over the same codes. The effects of the result are the
    t values, which compare across units; p is that of the response chosen.
    """
    tables = [s.table.set_index("code") for s in screenings]
    t = np.array([table["t"] for table in tables])
    pick = t.argmax(axis=0)
    codes = list(tables[0].index)
    rows = [
        {"code": c, "effect": float(t[k, n]), "p": float(tables[k].loc[c, "p"])}
        for n, (c, k) in enumerate(zip(codes, pick, strict=True))
    ]
    return replace(screenings[0], table=pd.DataFrame(rows))


def judge(runs, config):
    """The table of runs with what says how near each comes: `relative_error` of the target, and
    `desirability` where there are several targets."""
    mean = float(read_target(config).mean())
    runs = runs.assign(relative_error=(runs["response"] - mean).abs() / abs(mean))
    if config.further_targets:
        values = [runs[c] for c in columns(config)]
        runs["desirability"] = combined_desirability(goals(config), values)
    return runs


def nearest(runs):
    """The row of judged runs that comes nearest to what is wanted: of least error, or with several
    targets the most desirable one. Where none is acceptable in all targets, it is again the error
    of the first that counts."""
    if "desirability" in runs and runs["desirability"].max() > 0.0:
        return runs.loc[runs["desirability"].idxmax()]
    return runs.loc[runs["relative_error"].idxmin()]
