"""All runs of a study together: as one file, a row a run with what was varied and what came out,
and whether they are one sample.

A heap is chaotic, so numba, numpy or a processor of another family give another heap with the same
spec, and the same distribution of heaps (docs/reliability.md). A sample of two such draws is told
of.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.engines.templates import macros
from calibration.runs.plans import read_plan
from calibration.runs.store import RunStore
from calibration.study.config import numbers_of
from dem.errors import ResultError
from dem.results import OTHER

ABOUT = ["run", "stages", "experiment", "engine"]  # columns of words

CRATE = "provenance"
"""Folder of a study's results that holds copies of the others."""


def planned(folder: str | Path, plans: Iterable[str | Path] | None = None) -> dict[str, list[str]]:
    """{run name: [stages]} of plans of a study's folder, of all below it unless given."""
    found: dict[str, list[str]] = {}
    for path in sorted(map(Path, Path(folder).rglob("plan.json") if plans is None else plans)):
        stage = path.parent.resolve().relative_to(Path(folder).resolve()).as_posix()
        if stage.startswith(f"{CRATE}/"):
            continue
        for name in read_plan(path):
            found.setdefault(name, []).append(stage)
    return found


def finished(
    folder: str | Path, plans: Iterable[str | Path] | None = None
) -> list[tuple[str, list[str], dict[str, Any]]]:
    """[(run name, [stages], result)] of the `planned` runs that are done and can be trusted;
    `calibration verify` says which of the others are damaged."""
    store, found = RunStore(), []
    for name, stages in planned(folder, plans).items():
        try:
            found.append((name, stages, store.result(name)))
        except ResultError:
            continue
    return found


def runs_table(study: Any, runs: Sequence[tuple[str, list[str], dict[str, Any]]]) -> pd.DataFrame:
    """Table (pandas) of the `finished` runs of a study: name, stages, experiment and engine; the
    dotted keys of the run specs that are numbers and not the same in all runs, and those of the
    factors; the metrics, empty where a run has none of that name; its wall time."""
    rows, specs = [], []
    for name, stages, result in runs:
        rows.append(
            {"run": name, "stages": " ".join(stages), "experiment": result["experiment"]}
            | {"engine": result["engine"]}
            | result["metrics"]
            | {"wall_time_s": result["numerics"].get("wall_time_s")}
        )
        specs.append(numbers_of(result["spec"]))
    levels = pd.DataFrame(specs)
    kept = {f.key for f in study.factors} | {k for k in levels if levels[k].nunique(False) > 1}
    table = pd.DataFrame(rows)
    varied = levels[[k for k in levels if k in kept]]
    parts = [table[ABOUT], varied, table.drop(columns=ABOUT)]
    return pd.concat(parts, axis=1)


NAMED = ("numba", "numpy", "cpu")
"""Of a run's manifest: what makes another draw; the processor by its family, as LLVM names it."""


def mixtures(
    folder: str | Path, runs: Sequence[tuple[str, list[str], dict[str, Any]]] | None = None
) -> list[str]:
    """A sentence on each stage of a study's folder whose runs are of more than one draw: how many
    of each. runs: those that are `finished`, read unless given."""
    stages: dict[str, Counter[tuple[str, ...]]] = {}
    for _, names, result in finished(folder) if runs is None else runs:
        software = result["manifest"]["software"]
        draw = tuple(str(software.get(name, "unknown")) for name in NAMED)
        for stage in names if not result["engine"].startswith(OTHER) else ():
            stages.setdefault(stage, Counter())[draw] += 1
    said = macros("calibration.runs", "said")
    return [
        said.mixture(stage, draws.most_common(), NAMED)
        for stage, draws in sorted(stages.items())
        if len(draws) > 1
    ]
