"""The table of `dem new`: what is filled in is what options say, and each fault has its line; and
tables of readings that its options name."""

import csv
from pathlib import Path

import openpyxl
import pandas as pd
import pytest
import yaml

from calibration.interface.commands import main
from calibration.study.config import parse_config
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.new.methods import methods
from facts import tells

WHEAT = [
    ("grain", "density", "1.32 g/cm3"), ("grain", "moisture", "dry"),
    ("axes", "length", 6.2), ("axes", "width", 3.3), ("axes", "thickness", 2.9),
    ("lifted-cylinder", "angle", "26.1; 27.4; 28; 26.8; 27.9"),
    ("lifted-cylinder", "cylinder", 60), ("lifted-cylinder", "depth", 80),
    ("lifted-cylinder", "speed", 20),
    ("bulk-density", "density", 765), ("bulk-density", "sd", 6), ("bulk-density", "n", 5),
    ("drop", "rebound", 78), ("tilted-plane", "angle", 21), ("drop", "height", 300),
    ("drop", "wall", "steel"), ("drop", "rebound", 80),  # rows of one test may stand apart
    ("tilted-plane", "sd", 1), ("tilted-plane", "n", 5),
    ("tilted-plane", "wall", "steel"),
    ("shear-cell", "stress", "1.9; 2.1"), ("shear-cell", "load", 2),
    ("shear-cell", "stress", "3.4; 3.5"), ("shear-cell", "load", 4),
]  # fmt: skip
THE_SAME = (
    "--lifted-cylinder 26.1,27.4,28.0,26.8,27.9 cylinder=60mm depth=80mm speed=20mm/s "
    "--bulk-density 765kg/m3 sd=6kg/m3 n=5 --drop 78mm 80mm height=300mm wall=steel "
    "--tilted-plane 21 sd=1 n=5 wall=steel --axes 6.2x3.3x2.9mm --density 1.32g/cm3 "
    "--moisture dry --shear-cell 1.9kPa 2.1kPa load=2kPa --shear-cell 3.4kPa 3.5kPa load=4kPa"
).split()


def rows_of(name):
    """Rows of an empty table as the command writes it."""
    assert main(["new", "--table", name]) == 0
    if name.endswith(".csv"):
        return list(csv.reader(Path(name).read_text().splitlines()))
    return [list(row) for row in openpyxl.load_workbook(name).active.iter_rows(values_only=True)]


def filled(answers, name):
    """A table with these answers behind the questions and units that the command writes."""
    head, *rows = rows_of(name)
    units = {(row[0], row[1]): row[3] for row in rows}
    told = [[test, key, value, units.get((test, key), "")] for test, key, value in answers]
    if name.endswith(".csv"):
        with open(name, "w", newline="") as file:
            csv.writer(file).writerows([head[:4], *told])
    else:
        book = openpyxl.Workbook()
        for row in [head[:4], *told]:
            book.active.append(row)
        book.save(name)


@pytest.mark.parametrize("name", ["w.csv", "w.xlsx"])
def test_a_table_and_options_begin_the_same_study(here, name):
    filled(WHEAT, name)
    assert main(["new", "a", "--from", name, "--no-pilot"]) == 0
    assert main(["new", "b", *THE_SAME, "--no-pilot"]) == 0
    a, b = (yaml.safe_load(Path(n, "config.yaml").read_text().replace(f"{n}/", "")) for n in "ab")
    assert a | {"name": ""} == b | {"name": ""}
    left, right = (pd.read_csv(f"{n}/measured.csv").drop(columns="note") for n in "ab")
    pd.testing.assert_frame_equal(left, right)
    assert Path("a/factors.tsv").read_text() == Path("b/factors.tsv").read_text()
    given = pd.read_csv("a/given.csv")
    assert len(given) == sum(str(value).count(";") + 1 for *_, value in WHEAT)
    assert any(tells(place, name, "line 16") for place in given["from"])  # the drop's height


@pytest.mark.parametrize("name", ["w.csv", "w.xlsx"])
def test_the_empty_table_says_units_words_and_an_example(here, name):
    rows = {(row[0], row[1]): row for row in rows_of(name)}
    for method in methods().values():
        for q in method.questions:
            if q.needed:
                assert rows[method.name, q.key][4].endswith(q.example)
    assert rows["drop", "height"][3] == "mm"
    assert "steel" in rows["drop", "wall"][5]
    assert main(["new", "--table", name]) == 2  # it exists
    assert main(["new", "--table", "w.txt"]) == 2
    assert main(["new", "x", "--from", name]) == 2  # nothing is filled in


def test_every_fault_is_told_at_once_by_its_line(here, capsys):
    filled([
        ("grain", "density", 1.32),  # g/cm3, in a row of kg/m3
        ("axes", "length", 6.2), ("axes", "thickness", 3.3),
        ("lifted-cylinder", "angle", "26±1"),
        ("lifted-cylinder", "cylinder", 60), ("lifted-cylinder", "cylinder", 70),
        ("bulk-density", "density", 765),
        ("drop", "rebound", "78 kg"), ("drop", "height", 300), ("drop", "wall", "gold"),
        ("drop", "hight", 300), ("penetrometer", "depth", 3),
        ("tilted-plane", "angle", "26. Jan"), ("tilted-plane", "angle", "2026-01-26"),
    ], "w.csv")  # fmt: skip
    assert main(["new", "x", "--from", "w.csv"]) == 2
    said = capsys.readouterr().err
    for place, words in (
        ("w.csv, line 2", "1.32 g/cm³"),
        ("w.csv, axes", "width"),
        ("w.csv, line 5", "26±1"),
        ("w.csv, line 7", "cylinder"),
        ("w.csv, line 8", "one reading"),
        ("w.csv, line 9", "another kind"),
        ("w.csv, line 11", "steel"),
        ("w.csv, line 12", "did you mean height"),
        ("w.csv, line 13", "penetrometer"),
        ("w.csv, line 14", "known unit"),
        ("w.csv, line 15", "26.1"),
    ):
        assert any(place in line and words in line for line in said.splitlines()), (place, said)
    assert not Path("x").exists()


def test_decimal_commas_stand_beside_the_words_of_an_empty_table(here):
    rows = rows_of("w.csv")
    told = {
        ("grain", "density"): "1,32 g/cm3",
        ("grain", "diameter"): "3,9 mm",
        ("lifted-cylinder", "angle"): "26,1; 27,4",
        ("lifted-cylinder", "cylinder"): "60,5",
    }
    for row in rows:
        row[2] = told.get((row[0], row[1]), row[2])
    with open("w.csv", "w", newline="") as file:
        csv.writer(file, delimiter=";").writerows(rows)
    assert main(["new", "x", "--from", "w.csv", "--no-pilot"]) == 0
    config = yaml.safe_load(Path("x/config.yaml").read_text())
    assert config["run"]["materials"]["particle"]["density_kg_m3"] == 1320
    assert config["tests"]["cylinder"]["run"]["geometry"]["cylinder_diameter_mm"] == 60.5
    assert pd.read_csv("x/measured.csv")["value"].tolist() == [26.1, 27.4]


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
    return {(t.test, t.metric): read_joint_target(config, t) for t in joint_targets(config)}


def test_drops_and_shear_stresses_are_read_from_tables(here, capsys):
    """A title line, German headings, decimal commas, a cell with a unit of its own, and a column
    of no question, which is named."""
    assert new("--drop", "drops.csv", "height=300mm", "--shear-cell", "shear.csv") == 0
    found = targets()
    assert found["drop_300_mm", "rebound_height_mm"].mean == pytest.approx((78.5 + 81 + 76) / 3)
    stresses = {load: found[f"shear_{load}_kPa", "shear_stress_kPa"].mean for load in (2, 4, 8)}
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
    assert targets()["drop_300_mm", "rebound_height_mm"].mean == 79
    Path("study").rename("first")
    assert new("--shear-cell", "locus.csv") == 0
    assert targets()["shear_6_kPa", "shear_stress_kPa"].mean == pytest.approx(4.8)


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
