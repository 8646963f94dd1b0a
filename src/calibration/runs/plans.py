"""Plans of runs: which runs a stage needs, under the names by which they are cached.

A run is named after the content of its spec, so moving one point of a design runs one run. A plan
is a table: the design's columns, `seed`, `experiment`, `run_id`; the specs stand beside it in
plan.json.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import DamagedError, read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.store import REFUSED, RunStore
from calibration.study.config import Config, point_spec
from calibration.study.config.specs import SEEDS_A_STAGE
from calibration.study.factors import Factor, read_factors
from dem.errors import ResultError
from dem.io.files import write_json
from dem.results import is_current, run_name
from dem.spec import parse_spec

NAME = re.compile(r"\w[\w.-]*")
"""Of a planned run: one folder below the store's."""


def run_id(spec: Mapping[str, Any]) -> str:
    """Name of a run: experiment and content hash of its spec (a mapping)."""
    return run_name(parse_spec(spec))


def plan(
    design: pd.DataFrame,
    factors: Sequence[Factor],
    config: Config,
    experiment: str,
    run: Mapping[str, Any],
    seeds: int | None = None,
) -> tuple[pd.DataFrame, dict[str, dict[str, Any]]]:
    """Add `seed` and `run_id` to a design table; returns the table and {run_id: spec}. run: the run
    spec over which each row's levels are laid; seeds: which thousand of seeds the runs have, from
    the study's first on unless given.

    The n-th occurrence of a point has the n-th seed, so replicates differ. Raises CalibrationError
    where a point is repeated more often than these.
    """
    first_seed = config.seed + SEEDS_A_STAGE * (seeds or 0)
    used = [f for f in factors if f.name in design]
    seen: dict[Any, int] = {}
    rows, specs = [], {}
    for row in design.to_dict("records"):
        levels = {f.name: row[f.name] for f in used}
        levels = config.fixed | levels
        levels = {f.key: levels[f.name] for f in factors if f.name in levels}
        point = tuple(sorted(levels.items()))
        seed = first_seed + seen.get(point, 0)
        seen[point] = seen.get(point, 0) + 1
        if seeds is not None and seen[point] > SEEDS_A_STAGE:
            raise CalibrationError(
                f"a point is repeated more than {SEEDS_A_STAGE} times, which is as many seeds as "
                "a stage has"
            )
        spec = point_spec(run, experiment, levels, seed)
        name = run_id(spec)
        specs[name] = spec
        rows.append(row | {"seed": seed, "experiment": experiment, "run_id": name})
    added = [name for name in ("seed", "experiment", "run_id") if name not in design]
    return pd.DataFrame(rows, columns=[*design, *added]), specs


def together(
    parts: Iterable[tuple[pd.DataFrame, Mapping[str, Any]]],
) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Design tables and specs, as `plan` gives them, as one of each in the order of `parts`."""
    tables, specs = zip(*parts, strict=True)
    return pd.concat(tables, ignore_index=True), {k: s for own in specs for k, s in own.items()}


def write_plan(
    path: str | Path, table: pd.DataFrame, specs: Mapping[str, Any], made: Iterable[str] = ()
) -> None:
    """Write a plan.json and design.csv beside it, each atomically; made: runs of the design that
    another plan has."""
    write_table(table, Path(path).with_name("design.csv"))
    there = set(made)
    write_json(path, {name: spec for name, spec in specs.items() if name not in there})


def read_plan(path: str | Path) -> dict[str, dict[str, Any]]:
    """{run_id: spec} of a plan.json; empty when there is none yet. Raises DamagedError for a
    file that holds anything else."""
    path = Path(path)
    return _read_plan(path, path.stat().st_mtime_ns) if path.exists() else {}


@lru_cache(maxsize=64)
def _read_plan(path, _changed):
    """A plan is asked for by each of its runs."""
    found = read_json(path)
    if not (isinstance(found, dict) and all(isinstance(s, dict) for s in found.values())):
        raise DamagedError("holds no plan", path=path, allowed="{name of a run: its spec}")
    if odd := next((name for name in found if not NAME.fullmatch(name)), None):
        raise DamagedError("is no name of a run", path=path, value=odd)  # it would be a path
    return found


def planned_spec(study: str | Path, name: str) -> dict[str, Any] | None:
    """Spec of a run that a stage of a study's folder planned, its keys sorted; None where none did.

    Stages that share a run can have its keys in different orders. The order does not name the run,
    but snakemake takes another one for a change.
    """
    plans = plans_of(study)
    return next((_sorted(specs[name]) for _, specs in plans if name in specs), None)


def plans_of(study: str | Path) -> Iterator[tuple[str, dict[str, dict[str, Any]]]]:
    """(stage's folder, {run_id: spec}) of each plan in a study's folder. One that is damaged, which
    is planned again, counts as none."""
    for path in sorted(Path(study).glob("*/plan.json")):
        with suppress(DamagedError):
            yield path.parent.name, read_plan(path)


def _sorted(data):
    return {k: _sorted(data[k]) for k in sorted(data)} if isinstance(data, dict) else data


def read_metric(run_ids: Iterable[str], metric: str) -> list[float]:
    """Values [n] of one metric of finished runs. Raises CalibrationError for a run that is missing,
    damaged or of another engine, and for one without the metric."""
    found = _metrics(run_ids)
    for name, metrics in zip(run_ids, found, strict=True):
        if metric not in metrics:
            raise CalibrationError(
                f"{RunStore().folder(name)}: has no metric {metric}: {reason_without(name)}"
            )
    return [m[metric] for m in found]


def read_values(run_ids: Iterable[str], metric: str) -> np.ndarray:
    """Values (n,) of one metric of finished runs, NaN for runs without it. Raises CalibrationError
    for a run that is missing, damaged or of another engine."""
    return np.array([m.get(metric, np.nan) for m in _metrics(run_ids)], float)


def _metrics(run_ids):
    store = RunStore()
    return [_result(store, name)["metrics"] for name in run_ids]


def notes_of(name: str) -> str:
    """Return what a finished run says beside its numbers, as sentences; empty for most. Errors as
    `read_metric`."""
    return "; ".join(_result(RunStore(), name)["numerics"].get("notes", ()))


def reason_without(name: str) -> str:
    """Why a finished run has no value of a metric, in its own words; errors as `read_metric`."""
    refused = _result(RunStore(), name)["numerics"].get(REFUSED)
    return refused["reason"] if refused else "this experiment does not measure it"


AGAIN = "`calibration verify --repair` sets it aside, and the next start makes it again"


def _result(store, name):
    try:
        result = store.result(name)
    except ResultError as error:
        raise CalibrationError(f"{error}; {AGAIN}") from None
    if not is_current(result["engine"]):
        raise CalibrationError(
            f"{store.folder(name)}: was made by another engine, {result['engine']}; {AGAIN}"
        )
    return result


def points_of(name: str, config: Config) -> list[str]:
    """Sentences that say which points of which designs need the run `name`."""
    factors, found = read_factors(config.factors), []
    for path in sorted(Path(config.results, config.name).glob("*/design.csv")):
        design = read_written(path)
        if "run_id" not in design:  # a plan whose rows are no points of factors
            continue
        for row in design[design["run_id"] == name].to_dict("records"):
            levels = ", ".join(f"{f.name} {row[f.name]:g}" for f in factors if f.name in row)
            place = f"run {row['run']} of {len(design)}" if "run" in row else "a run"
            found.append(f"{path.parent.name}, {place}, seed {row['seed']}: {levels}")
    return found
