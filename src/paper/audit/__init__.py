"""Recompute every printed figure of the paper from its printed tables and say which agree."""

from paper.audit.paper import AuditInputError, Paper
from paper.audit.run import COLUMNS, run_audit, write_audit

__all__ = ["COLUMNS", "AuditInputError", "Paper", "run_audit", "write_audit"]
