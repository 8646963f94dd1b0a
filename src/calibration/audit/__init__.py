"""Recompute every printed figure of the paper from its printed tables and say which agree."""

from calibration.audit.paper import AuditInputError, Paper
from calibration.audit.report import write_audit
from calibration.audit.run import COLUMNS, run_audit

__all__ = ["COLUMNS", "AuditInputError", "Paper", "run_audit", "write_audit"]
