"""Recompute every printed figure of the paper from its printed tables and say which agree."""

from paper.audit import bench, materials, screening, surface, theory  # noqa: F401  (their checks)
from paper.audit.evaluate import COLUMNS, run_audit, write_audit
from paper.audit.paper import AuditInputError, Paper

__all__ = ["COLUMNS", "AuditInputError", "Paper", "run_audit", "write_audit"]
