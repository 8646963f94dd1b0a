"""The audit and the reproduction as the workflow calls them."""

from pathlib import Path

from paper.audit import run_audit, write_audit
from paper.reproduction import reproduce, write_reproduction


def audit(study, source, output):
    """Recompute every printed figure of the paper."""
    write_audit(run_audit(Path(source.tables[0]).parent), output.table, output.page)


def reproduction(study, source, output):
    """Set every table and equation of the paper beside this study's values, and those of the
    studies beside it."""
    others = [Path(path).parents[1] for path in source.beside]
    repeats = [Path(path).parents[1] for path in source.repeats]
    table = reproduce([study.folder, *others], study.config, repeats=repeats)
    write_reproduction(table, output.table, output.summary)
