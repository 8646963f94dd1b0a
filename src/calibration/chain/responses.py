"""Responses of a study's runs: their values, and those that have none."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.runs.plans import notes_of, read_values, reason_without
from calibration.study.config import Config


def with_responses(design: pd.DataFrame, config: Config) -> pd.DataFrame:
    """The design table (pandas) with the target of its finished runs in `response`. `response_sd`
    has the spread within a run, if the metric has one, and `note` what runs say beside their
    numbers, if any does.

    A run that finished without the metric, as a heap that is no heap does, has NaN there.
    """
    design = design.assign(response=read_values(design["run_id"], config.target))
    spread = read_values(design["run_id"], spread_of(config.target))
    if np.isfinite(spread).all():
        design["response_sd"] = spread
    notes = [notes_of(name) for name in design["run_id"]]
    return design.assign(note=notes) if any(notes) else design


def with_value(runs: pd.DataFrame) -> pd.DataFrame:
    """The rows of a table that have a response, numbered anew. Raises CalibrationError
    where fewer than two have one."""
    here = runs[runs["response"].notna()].reset_index(drop=True)
    if len(here) < 2:
        raise CalibrationError(
            f"{len(here)} of {len(runs)} runs have a response; nothing can be fitted to them"
        )
    return here


@contextmanager
def naming_left_out(runs: pd.DataFrame) -> Iterator[None]:
    """An analysis of the runs that have a response: where it fails, its CalibrationError
    names the others as well."""
    try:
        yield
    except CalibrationError as error:
        sentences = without_value(left_out(runs))
        if not sentences:
            raise
        raise CalibrationError(f"{error}. {' '.join(sentences)}") from None


def left_out(runs: pd.DataFrame) -> list[dict[str, Any]]:
    """[{run, reason}] of the runs of a table that finished without a response."""
    without = runs[runs["response"].isna()]
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
