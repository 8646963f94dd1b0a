"""The analysis of the paper's own runs finds what the paper found; that it prints its tables is the
audit's (`test_audit.py`)."""

from pathlib import Path

import pandas as pd

from calibration.statistics.screening import screen, significant
from calibration.study.factors import read_factors

TABLES = Path(__file__).parents[2] / "data" / "paper"


def table(name):
    return pd.read_csv(TABLES / name, comment="#")


def test_the_screening_of_table_6_sends_on_what_the_paper_does():
    runs = table("table06_plackett_burman.csv")
    screening = screen(runs, list("ABCDEFG"), runs["angle_deg"])
    assert significant(screening, 0.05) == ["G", "E", "C"]
    assert screening.method == "residual"


def test_shipped_factors_are_table_5():
    printed = table("table05_contact_parameter_ranges.csv")
    factors = read_factors(TABLES.parents[1] / "config" / "factors.tsv")
    assert [(f.code, f.name, f.low, f.high) for f in factors] == [
        tuple(row) for row in printed.itertuples(index=False)
    ]
