"""The one reader of tables that people give: measured values, factors, designs, sieve curves.

`read_table` takes what a spreadsheet or an instrument saved: it recognises encoding, separator and
decimal mark, reads workbooks, and refuses what can be read in two ways.
"""

from dem.tables.table import Table, read_table, table_of

__all__ = ["Table", "read_table", "table_of"]
