"""The audit and the reproduction as the workflow calls them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from paper.audit import run_audit, write_audit
from paper.reproduction.table import reproduce, write_reproduction

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study


def audit(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Recompute every printed figure of the paper."""
    write_audit(run_audit(Path(source.tables[0]).parent), output.table, output.page)


def reproduction(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Set the paper's results beside this study's values, and those of the studies beside it."""
    others = [Path(path).parents[1] for path in source.beside]
    repeats = list(dict.fromkeys(Path(path).parents[1] for path in source.repeats))
    table = reproduce([study.folder, *others], repeats=repeats)
    write_reproduction(table, output.table, output.summary)
