"""Readings of a laboratory's tests in tables that the options of `dem new` name."""

from pathlib import Path

import openpyxl
import pandas as pd
import pytest
import yaml

from calibration.interface.commands import main
from calibration.study.config import parse_config
from calibration.study.config.joint import joint_targets, read_joint_target
from facts import tells

GRAINS = "--density 2.7g/cm3 --grain 2mm --bulk-density 1500kg/m3 1510kg/m3".split()
DROPS = "Prüfbericht 12;;\nRückprallhöhe [mm];Datum;wall\n78,5;3.5.;steel\n81;;\n7,6 cm;;steel\n"
SHEARS = "normal stress [kPa],shear stress [kPa]\n2,1.9\n4,3.4\n6,4.8\n8,6400 Pa\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("drops.csv").write_text(DROPS)
    Path("shear.csv").write_text(SHEARS)
    return tmp_path


def new(*options):
    return main(["new", "study", *GRAINS, *options, "--no-pilot"])


def targets():
    path = Path("study", "config.yaml")
    config = parse_config(yaml.safe_load(path.read_text()), files=[path])
    return {(t.tests[0], t.metric): read_joint_target(config, t) for t in joint_targets(config)}


def test_drops_and_shear_stresses_are_read_from_tables(here, capsys):
    """A title line, German headings, decimal commas, a cell with a unit of its own, and a column
    of no question, which is named."""
    assert new("--drop", "drops.csv", "height=300mm", "--shear-cell", "shear.csv") == 0
    found = targets()
    assert found["drop_300_mm", "rebound_height_mm"].mean[0] == pytest.approx((78.5 + 81 + 76) / 3)
    stresses = {load: found[f"shear_{load}_kPa", "shear_stress_kPa"].mean[0] for load in (2, 4, 8)}
    assert stresses == {2: pytest.approx(1.9), 4: pytest.approx(3.4), 8: pytest.approx(6.4)}
    assert tells(capsys.readouterr().out, "drops.csv", "Datum")
    places = "\n".join(pd.read_csv("study/given.csv")["from"])
    assert tells(places, "drops.csv", "line 4", "Rückprallhöhe")


def test_what_dem_shear_writes_is_read_and_so_is_a_sheet(here):
    assert main(["shear", "shear.csv", "--out", "locus.csv"]) == 0
    book = openpyxl.Workbook()
    book.active.title = "notes"
    book.active.append(["measured in May"])
    sheet = book.create_sheet("rebounds")
    for row in (["rebound [mm]", "height [mm]"], [78, 300], [80, None]):
        sheet.append(row)
    book.save("tests.xlsx")
    options = "--drop tests.xlsx --sheet rebounds --shear-cell locus.csv".split()
    assert new(*options) == 2  # a text has no sheets
    assert new(*options[:4]) == 0
    assert targets()["drop_300_mm", "rebound_height_mm"].mean[0] == 79
    Path("study").rename("first")
    assert new("--shear-cell", "locus.csv") == 0
    assert targets()["shear_6_kPa", "shear_stress_kPa"].mean[0] == pytest.approx(4.8)


RIG = "--density 1.32g/cm3 --grain 4mm --orifice 25mm --plate 100mm --height 75mm --no-pilot"


def of_german_cells(*cells):
    """A workbook with a title above and cells that were typed as text, as spreadsheets have
    them."""
    book = openpyxl.Workbook()
    for row in (["Schüttversuche", ""], ["Versuch", "Winkel in °"], *enumerate(cells, 1)):
        book.active.append(row)
    book.save("angles.xlsx")


@pytest.mark.parametrize("cells", [("26,1", "28,4"), ("26,1", 28.4), ("26,1 °", "28.4")])
def test_a_text_cell_of_a_workbook_may_have_a_decimal_comma(here, cells):
    of_german_cells(*cells)
    assert main(["new", "w", "--measured", "angles.xlsx", *RIG.split()]) == 0
    kept = pd.read_csv("w/measured.csv")
    assert kept["value"].tolist() == [26.1, 28.4]


def test_a_text_cell_that_may_be_a_thousand_is_asked_about(here, capsys):
    of_german_cells("26,125", "28,4")
    assert main(["new", "w", "--measured", "angles.xlsx", *RIG.split()]) == 2
    assert tells(capsys.readouterr().err, "angles.xlsx, line 3", "26.125", "26125")
