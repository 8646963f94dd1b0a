"""What a rule has left, as it is written down: an edited file is found, and a record that is
missing or damaged means that the files are made again."""

from pathlib import Path

import pytest

from calibration.runs.records import (
    FOLDER,
    altered,
    changed_inputs,
    made_again,
    note,
    read_record,
    record,
    recorded,
)

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
    path = folder / made_again(folder, NAME, [table_of(folder)], content)
    return path.read_text().splitlines()[1] if path.exists() else None


def test_files_are_as_they_were_left(left):
    assert list(altered(left)) == list(changed_inputs(left)) == []
    assert recorded(left, table_of(left)) == NAME
    assert recorded(left, left / "plan.json") is None
    assert read_record(record_of(left))["files"].keys() == {"effects.csv"}
    assert why(left) is why(left, "abc") is None


def test_an_edited_file_and_an_edited_table_are_found(left):
    table_of(left).write_text("2")
    assert list(altered(left)) == [(NAME, table_of(left))]
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
    assert (left / FOLDER / f"{NAME}.txt").stat().st_mtime >= table_of(left).stat().st_mtime


def test_what_is_not_there_is_not_made_again(left):
    record_of(left).unlink()
    table_of(left).unlink()
    assert why(left) is None


def test_a_folder_that_can_only_be_read_stays_as_it_is(left, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError

    monkeypatch.setattr(Path, "write_text", refuse)
    note(left, NAME, "a reason")
    assert [path.name for path in (left / FOLDER).iterdir()] == [f"{NAME}.json"]
