"""What a rule has left, as it is written down: an edited file is found, and a record that is
missing or damaged means that the files are made again."""

import json
from pathlib import Path

import pytest

from calibration.errors import ConfigError
from calibration.files import set_aside
from calibration.runs.records import (
    FOLDER,
    altered,
    changed_inputs,
    made_again,
    read_record,
    record,
    recorded,
    refuse_others,
    refuse_outside,
)
from calibration.runs.verify import faults_of, repair
from dem.io.checked import sealed
from facts import refused

NAME = "screening"


@pytest.fixture
def left(tmp_path):
    """A study's folder with a table that a rule has left, beside a table of the user."""
    folder = tmp_path / "results" / "wheat"
    folder.mkdir(parents=True)
    (folder / "effects.csv").write_text("1")
    (folder / "heaps").mkdir()
    (tmp_path / "factors.tsv").write_text("a")
    outputs = [folder / "effects.csv", folder / "heaps", folder / "none.csv"]
    record(folder, NAME, "abc", outputs, [tmp_path / "factors.tsv", tmp_path / "none.tsv"])
    return folder


def table_of(folder):
    return folder / "effects.csv"


def record_of(folder):
    return folder / FOLDER / f"{NAME}.json"


def why(folder, content=None):
    """The reason to make the files again, or None."""
    return made_again(folder, NAME, [table_of(folder)], content)


def test_files_are_as_they_were_left(left):
    assert list(altered(left)) == list(changed_inputs(left)) == []
    assert recorded(left, table_of(left)) == NAME
    assert recorded(left, left / "plan.json") is None
    assert read_record(record_of(left))["files"].keys() == {"effects.csv"}
    assert why(left) is why(left, "abc") is None


def test_an_edited_file_and_an_edited_table_are_found(left):
    table_of(left).write_text("2")
    assert list(altered(left)) == [(NAME, table_of(left))]
    assert why(left).startswith(str(table_of(left)))
    table = left.parents[1] / "factors.tsv"
    table.write_text("b")
    assert list(changed_inputs(left)) == [(NAME, table)]
    table.unlink()  # results were moved away from their study
    assert list(changed_inputs(left)) == []


def test_another_digest_makes_the_files_again(left):
    assert "have changed" in why(left, "abd")


DAMAGE = {
    "missing": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-9]),
    "no text": lambda path: path.write_bytes(b"\xff\xfe\x00\x81"),
    "a list": lambda path: path.write_text("[]"),
    "a number": lambda path: path.write_text("3"),
    "another digest": lambda path: path.write_text(path.read_text().replace("abc", "abd")),
    "an older version's": lambda path: path.write_text('{"effects.csv": "1"}'),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_record_that_is_missing_or_damaged_makes_the_files_again(left, damage):
    damage(record_of(left))
    assert list(altered(left)) == []
    assert "nothing says" in why(left)


def test_what_is_missing_is_made_again_where_a_record_has_it(left):
    table_of(left).unlink()
    assert list(altered(left)) == [(NAME, table_of(left))]
    assert why(left).startswith(str(table_of(left)))
    record_of(left).unlink()
    assert why(left) is None


OUTSIDE = {
    "above": lambda study: "../../thesis.txt",
    "absolute": lambda study: str(study.parents[1] / "thesis.txt"),
    "behind a link": lambda study: "link/thesis.txt",
    "a link itself": lambda study: "thesis.txt",
}


@pytest.mark.parametrize("name", OUTSIDE.values(), ids=OUTSIDE)
def test_a_record_that_names_a_file_outside_of_the_study_is_none(left, name):
    """Its checksum fits: whoever sends a study can compute it."""
    outside = left.parents[1] / "thesis.txt"
    outside.write_text("years of work")
    (left / "link").symlink_to(outside.parent)
    (left / "thesis.txt").symlink_to(outside)
    found = read_record(record_of(left)) | {"files": {name(left): "0" * 64}}
    record_of(left).write_text(json.dumps(sealed(found)))
    assert read_record(record_of(left)) is None
    assert [fault.file for fault in faults_of(left.parent)] == [record_of(left)]
    repair(faults_of(left.parent), left.parent, tell=lambda text: None)
    assert outside.read_text() == "years of work"
    assert list(outside.parent.glob("thesis*")) == [outside]


def test_a_table_of_the_user_is_never_renamed(left):
    """Though a record says that a rule read it, and it has changed since."""
    outside = left.parents[1] / "factors.tsv"
    record(left, NAME, "abc", [table_of(left)], [left / "../../factors.tsv"])
    outside.write_text("b")
    [fault] = faults_of(left.parent)
    assert "factors.tsv" in str(fault)
    repair([fault], left.parent, tell=lambda text: None)
    assert outside.read_text() == "b"


def test_a_second_setting_aside_keeps_the_first(tmp_path):
    file = tmp_path / "table.csv"
    for text in ("first", "second", "third"):
        file.write_text(text)
        set_aside(file)
    assert not file.exists()
    kept = [tmp_path / f"table.csv.damaged{end}" for end in ("", ".2", ".3")]
    assert [path.read_text() for path in kept] == ["first", "second", "third"]


def test_what_is_set_aside_leaves_a_folder_that_is_made_again(left):
    """snakemake deletes a deck, a folder that is a rule's output, before it makes it again."""
    deck = left / "exports/lammps/in.lammps"
    deck.parent.mkdir(parents=True)
    deck.write_text("as written")
    record(left, "export", "abc", [deck])
    deck.write_text("as edited")
    repair(faults_of(left.parent), left.parent, tell=lambda text: None)
    assert not deck.exists()
    assert (left / "exports/in.lammps.damaged").read_text() == "as edited"


def test_a_folder_of_somebody_else_is_refused(tmp_path):
    folder = tmp_path / "projects"
    refuse_others(folder)
    (folder / "logs").mkdir(parents=True)
    refuse_others(folder)
    (folder / "plan.json").write_text("{}")
    with refused(ConfigError, str(folder), FOLDER):
        refuse_others(folder)
    (folder / FOLDER).mkdir()
    refuse_others(folder)


@pytest.mark.parametrize("results", ["../home", "/scratch/me", "a/../../home"])
def test_results_elsewhere_are_asked_for_on_the_command_line(results, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with refused(ConfigError, "results", results, f"--config results={results}"):
        refuse_outside(results, {"name": "projects"})
    refuse_outside(results, {"results": results})
    refuse_outside("kept/here", None)
