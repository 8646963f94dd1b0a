"""Tables of a study: those that people give, by the one reader (`dem.tables`), what was read said
back, and what a stage wrote."""

from calibration.intake.tables.given import Table, read_table, table_of
from calibration.intake.tables.report import summary
from calibration.intake.tables.written import read_written

__all__ = [
    "Table",
    "read_table",
    "read_written",
    "summary",
    "table_of",
]
