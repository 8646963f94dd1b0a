"""The measured table-tennis ball: its table follows from the printed intervals, and the diagnosis
finds the air."""

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from diagnosis.measurements import read_all

FOLDER = Path("data/literature")


def script(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


DERIVED = script("derive").TABLES


@pytest.mark.parametrize("name", DERIVED)
def test_a_table_is_what_its_readings_give(name):
    table = pd.read_csv(FOLDER / f"{name}.csv", comment="#")
    again = DERIVED[name]().reset_index(drop=True)
    pd.testing.assert_frame_equal(table, again, check_exact=False, rtol=1e-9)


def test_a_day_is_a_batch():
    """Both days' rows are those of their own files."""
    one, two, both = (
        read_all(FOLDER / f"shear_annular_wet_{k}.csv").fitted for k in ("day1", "day2", "two_days")
    )
    assert [replace(m, batch="") for m in both] == [*one, *two]
    assert [m.batch for m in both] == ["day 1"] * 3 + ["day 2"] * 3


def test_every_set_has_its_finding_and_its_source():
    findings = script("findings")
    kept, page = json.loads(findings.KEPT.read_text()), findings.PAGE.read_text()
    assert set(kept) == set(findings.ALL)
    for name in findings.ALL:
        first = (FOLDER / f"{name}.csv").read_text().splitlines()[0]
        assert first.startswith("# ")
        assert f"`{name}.csv`" in page


def test_the_page_shows_the_kept_findings():
    findings = script("findings")
    kept = json.loads(findings.KEPT.read_text())
    assert findings.shown(findings.PAGE.read_text()) == findings.table(kept)


@pytest.mark.parametrize(
    "name",
    [
        "shear_annular_wet_day1",
        "shear_quartz_sand_peak",
        pytest.param("table_tennis_ball", marks=pytest.mark.slow),
    ],
)
def test_a_kept_finding_comes_out_again(name):
    findings = script("findings")
    assert findings.finding(name) == json.loads(findings.KEPT.read_text())[name]
