"""Responses of a study: which metric of the runs each is, which factors matter to any, and which
point is nearest."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.runs.plans import notes_of, read_values, reason_without
from calibration.statistics.goals import combined_desirability
from calibration.statistics.screening import Screening
from calibration.study.config import Config, goals, read_target


def columns(config: Config) -> dict[str, str]:
    """{column of the design tables: metric}; the target's is `response`, the others bear their
    metric's name."""
    return {"response": config.target.metric} | {t.metric: t.metric for t in config.further_targets}


def with_responses(design: pd.DataFrame, config: Config) -> pd.DataFrame:
    """The design table (pandas) with the metrics of its finished runs in `columns`. `response_sd`
    has the spread within a run, if the target's metric has one, and `note` what runs say beside
    their numbers, if any does.

    A run that finished without the metric, as a heap that is no heap does, has NaN there.
    """
    design = design.copy()
    for column, metric in columns(config).items():
        design[column] = read_values(design["run_id"], metric)
    spread = read_values(design["run_id"], spread_of(config.target.metric))
    if np.isfinite(spread).all():
        design["response_sd"] = spread
    notes = [notes_of(name) for name in design["run_id"]]
    return design.assign(note=notes) if any(notes) else design


def with_value(runs: pd.DataFrame, column: str) -> pd.DataFrame:
    """The rows of a table that have a value in `column`, numbered anew. Raises CalibrationError
    where fewer than two have one."""
    here = runs[runs[column].notna()].reset_index(drop=True)
    if len(here) < 2:
        raise CalibrationError(
            f"{len(here)} of {len(runs)} runs have a value of {column}; nothing can be fitted to "
            f"them"
        )
    return here


@contextmanager
def naming_left_out(runs: pd.DataFrame, column: str = "response") -> Iterator[None]:
    """An analysis of the runs that have a value in `column`: where it fails, its CalibrationError
    names the others as well."""
    try:
        yield
    except CalibrationError as error:
        sentences = without_value(left_out(runs, column))
        if not sentences:
            raise
        raise CalibrationError(f"{error}. {' '.join(sentences)}") from None


def left_out(runs: pd.DataFrame, column: str = "response") -> list[dict[str, Any]]:
    """[{run, reason}] of the runs of a table that finished without a value in `column`."""
    without = runs[runs[column].isna()]
    return [
        {"run": int(number), "reason": reason_without(name)}
        for number, name in zip(without["run"], without["run_id"], strict=True)
    ]


def told(runs: pd.DataFrame) -> dict[str, Any]:
    """Return what a stage's summary says of single runs: `left_out`, and where a run has a note
    `noted`, [{run, note}]."""
    found: dict[str, Any] = {"left_out": left_out(runs)}
    if "note" in runs:
        noted = runs[runs["note"] != ""]
        rows = zip(noted["run"], noted["note"], strict=True)
        found["noted"] = [{"run": int(number), "note": note} for number, note in rows]
    return found


def without_value(left_out: Iterable[dict[str, Any]]) -> list[str]:
    """Sentences that name the runs of `left_out`, one for each reason."""
    by_reason: dict[str, list[str]] = {}
    for row in left_out:
        by_reason.setdefault(row["reason"], []).append(str(row["run"]))
    return [
        f"Left out, because without a value: run {', '.join(numbers)} ({reason})."
        for reason, numbers in by_reason.items()
    ]


def spread_of(metric: str) -> str:
    """Name of the metric that holds the spread of another within a run: `_sd` before the unit."""
    return re.sub(r"_([^_]+)$", r"_sd_\1", metric)


def strongest(screenings: Sequence["Screening"]) -> "Screening":
    """One screening for several responses: each factor with the response that it moves most for its
    error.

    screenings: `Screening` of each response over the same codes. The effects of the result are the
    t values, which compare across units; p is that of the response chosen.
    """
    every = pd.concat([s.table for s in screenings], ignore_index=True)
    best = every.loc[every.groupby("code", sort=False)["t"].idxmax()].reset_index(drop=True)
    return replace(screenings[0], table=best.assign(effect=best["t"])[["code", "effect", "p"]])


def judge(runs: pd.DataFrame, config: Config) -> pd.DataFrame:
    """The table of runs with what says how near each comes: `relative_error` of the target, and
    `desirability` where there are several targets."""
    mean = float(read_target(config).mean())
    runs = runs.assign(relative_error=(runs["response"] - mean).abs() / abs(mean))
    if config.further_targets:
        values = [runs[c] for c in columns(config)]
        runs["desirability"] = combined_desirability(goals(config), values)
    return runs


def nearest(runs: pd.DataFrame) -> pd.Series:
    """The row of judged runs that comes nearest to what is wanted: of least error, or with several
    targets the most desirable one. Where none is acceptable in all targets, it is again the error
    of the first that counts."""
    if "desirability" in runs and runs["desirability"].max() > 0.0:
        return runs.loc[runs["desirability"].idxmax()]
    return runs.loc[runs["relative_error"].idxmin()]
