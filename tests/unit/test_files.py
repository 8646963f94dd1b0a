"""Tables that a spreadsheet opens hold no formula, and what killed writers left goes."""

import csv
import io
import os
import time

import pandas as pd
import pytest

from calibration.files import csv_text, sweep_abandoned, write_table

FORMULAS = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", "a\r=1"]


@pytest.mark.parametrize("cell", FORMULAS)
def test_no_cell_and_no_heading_is_a_formula(cell, tmp_path):
    table = pd.DataFrame({"note": [cell, "plain"], cell: [1.5, -2.5]})
    write_table(table, tmp_path / "t.csv")
    text = (tmp_path / "t.csv").read_bytes().decode()
    cells = [c for row in csv.reader(io.StringIO(text, newline="")) for c in row]
    assert not [c for c in cells if c.strip()[:1] in tuple("=+@")]
    assert [c for c in cells if c.startswith("-")] == ["-2.5"]


def test_no_cell_is_a_formula_behind_a_semicolon():
    """As a spreadsheet reads it that takes no comma for a separator."""
    rows = csv_text(pd.DataFrame({"a": ["x"] * 3, "b": ["a, b\n=1;2", "\uff1d1", "\ufeff@x"]}))
    cells = [
        cell for row in rows.splitlines() for part in row.split(";") for cell in part.split(",")
    ]
    assert not [cell for cell in cells if cell.strip('" \ufeff')[:1] in ("=", "@", "\uff1d")]


def test_numbers_and_words_come_back_as_they_were():
    table = pd.DataFrame({"x": [-1.0, 2.5e-9], "name": ["a-b", "+1.5"], "n": [1, -2]})
    pd.testing.assert_frame_equal(
        pd.read_csv(io.StringIO(csv_text(table)), dtype={"name": str}), table
    )


@pytest.mark.parametrize("pattern", [".partial.{}.runs.csv", ".screening.json.{}.partial"])
def test_abandoned_files_go_and_those_being_written_stay(tmp_path, pattern):
    (tmp_path / "a").mkdir()
    old, new = (tmp_path / "a" / pattern.format(number) for number in (12, 13))
    for path in (old, new):
        path.write_text("half")
    os.utime(old, (time.time() - 7200,) * 2)
    sweep_abandoned(tmp_path)
    assert (old.exists(), new.exists()) == (False, True)
