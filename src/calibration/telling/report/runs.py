"""Which runs a study is made of: their number, seeds, size and time."""

import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.figures import label
from calibration.files import csv_text
from calibration.intake.tables import read_written
from calibration.runs.draws import mixtures
from calibration.runs.store import RunStore
from calibration.study.stage import Stage
from calibration.telling.report.embed import html_of, packed
from dem.errors import ResultError


def _results(study, stages):
    """[(stage, name, result)] of the runs of all designs."""
    found, store = [], RunStore()
    plans = [plan.folder for stage in stages.values() for plan in stage.plans]
    for stage in plans:
        design = study / stage / "design.csv"
        for name in read_written(design)["run_id"] if design.exists() else []:
            with suppress(ResultError):  # the study was moved here without all of its runs
                found.append((stage, name, store.result(name)))
    return found


def _row(result):
    numerics = result["numerics"]
    return {
        "seed": result["seed"],
        "particles": result["spec"]["particles"]["count"],
        "steps": numerics.get("steps"),
        "simulated_time_s": numerics.get("simulated_time_s"),
        "wall_time_s": numerics.get("wall_time_s", math.nan),  # a run without a value has none
        "engine": result["engine"],
    }


def runs_section(study: Path, stages: Mapping[str, Stage]) -> dict[str, Any] | None:
    """The section of run times and seeds, or None where no run is at hand."""
    found = _results(study, stages)
    runs = pd.DataFrame([{"stage": s, "run_id": n} | _row(result) for s, n, result in found])
    if runs.empty:
        return None
    rows = [
        {
            "stage": label(stage),
            "runs": len(own),
            "seeds": _span(own["seed"]),
            "particles": _span(own["particles"]),
            "steps per run": int(own["steps"].mean()) if own["steps"].notna().all() else "",
            "time per run [s]": f"{own['wall_time_s'].mean():.3g}",
            "together [min]": f"{own['wall_time_s'].sum() / 60.0:.2g}",
        }
        for stage, own in runs.groupby("stage", sort=False)
    ]
    timed = runs.dropna(subset="wall_time_s").drop_duplicates("run_id")
    drawn = [(name, [stage], result) for stage, name, result in found]
    total = timed["wall_time_s"].sum() / 60.0
    engines = ", ".join(sorted(runs["engine"].unique()))
    return {
        "key": "runs",
        "title": "Runs, times and seeds",
        "texts": [
            f"{timed['run_id'].nunique()} runs took {total:.1f} minutes of one core, by engine "
            f"{engines}. A run that two stages share was made once.",
            *(f"{mixture}." for mixture in mixtures(study, drawn)),
        ],
        "figures": [],
        "tables": [
            {
                "title": "Runs by stage",
                "html": html_of(pd.DataFrame(rows)),
                "rows": len(rows),
                "shown": len(rows),
                "open": True,
                "download": packed("runs.csv", csv_text(runs).encode()),
            }
        ],
    }


def _span(values):
    low, high = values.min(), values.max()
    return f"{low}" if low == high else f"{low} to {high}"
