"""The one reader of tables: measured values, factors, measurements, designs, sieve curves, and what
a stage wrote.

`read_table` takes what a spreadsheet or an instrument saved: it recognises encoding, separator and
decimal mark, reads
workbooks, and refuses what can be read in two ways. `read_rows` gives the cells of a table that is
laid out in its own way. `read_written` takes what this project wrote itself.
"""

from calibration.tables.report import summary
from calibration.tables.table import Table, read_rows, read_table, table_of
from calibration.tables.written import read_written

__all__ = ["Table", "read_rows", "read_table", "read_written", "summary", "table_of"]
