"""The workbook of `dem new`: what is filled in is what options say, and each fault has its sheet
and cell."""

from pathlib import Path

import openpyxl
import pandas as pd
import pytest
import yaml

from calibration.interface.commands import main
from calibration.study.new.methods import methods
from facts import tells

FIRST_ROW = 6
WHEAT = {
    "grain": [{"density": "1,32 g/cm3", "moisture": "dry"}],
    "axes": [{"length": 6.2, "width": 3.3, "thickness": 2.9}],
    "lifted-cylinder": [{"angle": 26.1, "cylinder": 60, "depth": 80, "speed": 20},
                        {"angle": 27.4}, {"angle": 28}, {"angle": "26,8"}, {"angle": 27.9}],
    "bulk-density": [{"density": 765, "sd": 6, "n": 5}],
    "drop": [{"rebound": 78, "height": 300, "wall": "steel"}, {"rebound": 80}],
    "tilted-plane": [{"angle": 21, "sd": 1, "n": 5, "wall": "steel"}],
    "shear-cell": [{"stress": 1.9, "load": 2}, {"stress": 2.1}, {"stress": 3.4, "load": 4},
                   {"stress": 3.5}],
}  # fmt: skip
THE_SAME = (
    "--lifted-cylinder 26.1,27.4,28.0,26.8,27.9 cylinder=60mm depth=80mm speed=20mm/s "
    "--bulk-density 765kg/m3 sd=6kg/m3 n=5 --drop 78mm 80mm height=300mm wall=steel "
    "--tilted-plane 21 sd=1 n=5 wall=steel --axes 6.2x3.3x2.9mm --density 1.32g/cm3 "
    "--moisture dry --shear-cell 1.9kPa 2.1kPa load=2kPa --shear-cell 3.4kPa 3.5kPa load=4kPa"
).split()


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def filled(sheets, name="w.xlsx"):
    """An empty workbook as the command writes it, with rows of values below the example."""
    assert main(["new", "--workbook", name]) == 0
    book = openpyxl.load_workbook(name)
    for sheet, rows in sheets.items():
        columns = {str(c.value).split(" [")[0]: c.column for c in book[sheet][2] if c.value}
        for line, row in enumerate(rows, FIRST_ROW):
            for key, value in row.items():
                book[sheet].cell(line, columns[key], value)
    book.save(name)
    return book


def test_a_workbook_and_options_begin_the_same_study(here):
    filled(WHEAT)
    assert main(["new", "a", "--from", "w.xlsx", "--no-pilot"]) == 0
    assert main(["new", "b", *THE_SAME, "--no-pilot"]) == 0
    a, b = (yaml.safe_load(Path(n, "config.yaml").read_text().replace(f"{n}/", "")) for n in "ab")
    assert a | {"name": ""} == b | {"name": ""}
    left, right = (pd.read_csv(f"{n}/measured.csv").drop(columns="note") for n in "ab")
    pd.testing.assert_frame_equal(left, right)
    assert Path("a/factors.tsv").read_text() == Path("b/factors.tsv").read_text()
    given = pd.read_csv("a/given.csv")
    cells = sum(len(row) for rows in WHEAT.values() for row in rows)
    assert len(given) == cells
    assert any(tells(place, "w.xlsx", "drop", "C6") for place in given["from"])


def test_the_empty_workbook_says_units_words_and_an_example(here):
    assert main(["new", "--workbook", "w.xlsx"]) == 0
    book = openpyxl.load_workbook("w.xlsx")
    assert set(methods()) < set(book.sheetnames)
    for method in methods().values():
        sheet = book[method.name]
        head = [c.value for c in sheet[2]]
        for q in method.questions:
            if q.needed:
                [column] = [k for k, h in enumerate(head) if str(h).split(" [")[0] == q.key]
                assert sheet.cell(5, column + 1).value == q.example
    assert "height [mm]" in [c.value for c in book["drop"][2]]
    [choice] = book["drop"].data_validations.dataValidation
    assert "steel" in choice.formula1
    assert main(["new", "--workbook", "w.xlsx"]) == 2  # it exists
    assert main(["new", "--workbook", "w.csv"]) == 2
    assert main(["new", "x", "--from", "w.xlsx"]) == 2  # nothing is filled in


def test_every_fault_is_told_at_once_by_sheet_and_cell(here, capsys):
    wrong = {
        "grain": [{"density": 1.32}],  # g/cm3, under a heading of kg/m3
        "axes": [{"length": 6.2, "thickness": 3.3}],
        "lifted-cylinder": [{"angle": "26±1"}, {"cylinder": 60}],
        "bulk-density": [{"density": 765}],
        "drop": [{"rebound": "78 kg", "height": 300, "wall": "gold"}],
    }
    filled(wrong)
    assert main(["new", "x", "--from", "w.xlsx"]) == 2
    said = capsys.readouterr().err
    for place, words in (
        ("sheet grain, cell B6", "1.32 g/cm³"),
        ("sheet axes", "width"),
        ("sheet lifted-cylinder, cell B6", "26±1"),
        ("sheet lifted-cylinder, line 7", "angle"),
        ("sheet bulk-density, cell B6", "one reading"),
        ("sheet drop, cell B6", "another kind"),
        ("sheet drop, cell D6", "steel"),
    ):
        assert any(place in line and words in line for line in said.splitlines()), place
    assert not Path("x").exists()


@pytest.mark.parametrize(
    ("sheet", "cell", "value", "words"),
    [
        ("drop", "B5", 77, ["sheet drop, line 5", "example"]),
        ("drop", "A2", "Frage", ["sheet drop", "headings"]),
        ("drop", "K7", 5, ["sheet drop, cell K7", "no heading"]),
        ("drop", "C2", "hight [mm]", ["sheet drop, cell C6", "did you mean height"]),
        ("mine", "A1", 5, ["sheet mine", "is no test"]),
        ("drop", "B7", "=1+1", ["sheet drop", "formula"]),
    ],
)
def test_a_sheet_that_was_changed_is_told(here, capsys, sheet, cell, value, words):
    book = filled(WHEAT)
    own = book[sheet] if sheet in book.sheetnames else book.create_sheet(sheet)
    own[cell] = value
    book.save("w.xlsx")
    assert main(["new", "x", "--from", "w.xlsx"]) == 2
    said = capsys.readouterr().err
    for word in words:
        assert word in said
    assert not Path("x").exists()


def test_a_heading_in_another_unit_counts(here):
    book = filled(WHEAT)
    book["drop"]["C2"] = "height [cm]"
    book["drop"]["C6"] = 30
    book["notes"]["A1"] = "made on a Friday"
    book.save("w.xlsx")
    assert main(["new", "x", "--from", "w.xlsx", "--no-pilot"]) == 0
    config = yaml.safe_load(Path("x/config.yaml").read_text())
    assert config["rigs"]["drop_300_mm"]["run"]["geometry"]["drop_height_mm"] == 300


@pytest.mark.parametrize("cell", ["XFD1048576", "XFD9", "A1048576"])
def test_a_cell_far_from_all_others_is_told(here, capsys, cell):
    filled(WHEAT)
    book = openpyxl.load_workbook("w.xlsx")
    book["drop"][cell] = 3
    book.save("w.xlsx")
    capsys.readouterr()
    assert main(["new", "x", "--from", "w.xlsx", "--no-pilot"]) == 2
    assert tells(capsys.readouterr().err, "w.xlsx", "drop", "1,000 columns")
