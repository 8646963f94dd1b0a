"""Whether the runs of a stage are one sample.

A heap is chaotic, so numba, numpy or a processor of another family give another heap with the same
spec, and the same distribution of heaps (docs/reliability.md). A sample of two such draws is told
of.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from calibration.engines.templates import macros
from calibration.runs.plans import read_plan
from calibration.runs.store import RunStore
from dem.errors import ResultError
from dem.results import OTHER

NAMED = ("numba", "numpy", "cpu")
"""Of a run's manifest: what makes another draw; the processor by its family, as LLVM names it."""


def finished(folder: str | Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """(stage, result) of the runs that a study's folder has planned, that are done and can be
    trusted; `calibration verify` says which of the others are damaged."""
    store = RunStore()
    for path in sorted(Path(folder).rglob("plan.json")):
        for name in read_plan(path):
            with suppress(ResultError):
                yield path.parent.relative_to(folder).as_posix(), store.result(name)


def mixtures(runs: Iterable[tuple[str, dict[str, Any]]]) -> list[str]:
    """A sentence on each stage of `finished` runs that are of more than one draw: how many of
    each."""
    stages: dict[str, Counter[tuple[str, ...]]] = {}
    for stage, result in runs:
        software = result["manifest"]["software"]
        draw = tuple(str(software.get(name, "unknown")) for name in NAMED)
        if not result["engine"].startswith(OTHER):
            stages.setdefault(stage, Counter())[draw] += 1
    said = macros("calibration.runs", "said")
    return [
        said.mixture(stage, draws.most_common(), NAMED)
        for stage, draws in sorted(stages.items())
        if len(draws) > 1
    ]
