"""Draws of the joint posterior run in the machines of `push_through`, and which parameter each
metric owes its spread there."""

from typing import Any

import numpy as np
import pandas as pd
import scipy

from calibration.chain import push_through
from calibration.files import write_table
from calibration.intake.tables import read_written

LEVEL = 0.95
LEAST_DRAWS = 4
"""Draws that an interval of a correlation needs (Fisher's z has n - 3)."""


def plan_joint_push_through(study: Any, source: Any, output: Any) -> None:
    """Plan the machines as `plan_push_through` does, with draws of the joint posterior."""
    push_through.plan_push_through(study, source, output)


def joint_push_through(study: Any, source: Any, output: Any) -> None:
    """What `push_through` says of the machines, and each parameter's share of the spread. Writes
    the outputs that the rule declares."""
    push_through.push_through(study, source, output)
    metrics, runs = read_written(output.metrics), read_written(output.runs)
    rows = []
    for row in metrics.to_dict("records"):
        own = runs[runs["machine"] == row["machine"]]
        rows += _rows(study.factors, row, own[own[row["metric"]].notna()])
    columns = ["machine", "metric", "parameter", "share", "low", "high", "correlation"]
    write_table(pd.DataFrame(rows, columns=columns), output.shares)


def _rows(factors, row, runs):
    """A row a parameter whose level differs from draw to draw."""
    names = [f.name for f in factors if f.name in runs and runs[f.name].nunique() > 1]
    means = runs.groupby("draw")[[row["metric"], *names]].mean()
    if len(means) < LEAST_DRAWS or means[row["metric"]].nunique() < 2:
        return []
    # what of the scatter between the means of draws is not the seeds'
    clear = min(row["sd_parameters"] ** 2 / means[row["metric"]].var(), 1.0)
    found = []
    for name in names:
        share, low, high, r = _share(means[name], means[row["metric"]], clear)
        found.append({"machine": row["machine"], "metric": row["metric"], "parameter": name}
                     | {"share": share, "low": low, "high": high, "correlation": r})  # fmt: skip
    return found


def _share(levels, values, clear):
    """(share, low, high, correlation): of the variance of values (n,) without the seeds' part, that
    which goes in a straight line with levels (n,).

    The first-order share of a linear response, whatever hangs together with the parameter, with its
    95 % interval by Fisher's z; `clear`: part of the variance of the values that is not the seeds'.
    """
    r = float(np.corrcoef(levels, values)[0, 1])
    reach = scipy.stats.norm.ppf(0.5 + 0.5 * LEVEL) / np.sqrt(len(levels) - 3)
    ends = np.tanh(np.arctanh(np.clip(r, -1.0 + 1e-12, 1.0 - 1e-12)) + np.array([-reach, reach]))
    low = 0.0 if ends[0] < 0.0 < ends[1] else float((ends**2).min())
    whole = max(clear, 1e-12)
    share, low, high = (float(min(x / whole, 1.0)) for x in (r**2, low, (ends**2).max()))
    return share, low, high, r


def sentences(summary: dict, response: Any) -> list[str]:
    """What came out, for the report; the shares stand in their table."""
    said: list[str] = push_through.sentences(summary, response)
    return said
