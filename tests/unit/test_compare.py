"""Two studies side by side: each number stands in the column of its study."""

import re

import pytest

from calibration.errors import CalibrationError
from calibration.figures import label
from calibration.files import read_json
from calibration.interface.cli import main
from calibration.telling.compare import NONE, compare
from facts import refused
from frozen import FROZEN

SALT = FROZEN / "salt"


def rows_of(text):
    """{title: {first cell: (of the first study, of the second)}} of a page."""
    out = {}
    for part in re.split(r"^## ", text, flags=re.M)[1:]:
        title, *lines = part.strip().splitlines()
        cells = [[c.strip() for c in line.strip("|").split("|")] for line in lines if line]
        out[title] = {c[0]: tuple(c[1:]) for c in cells[2:]}
    return out


@pytest.fixture
def other(tmp_path):
    """A study that has an optimum of one parameter of the salt and one of its own, and nothing
    else."""
    folder = tmp_path / "other" / "optimise"
    folder.mkdir(parents=True)
    name = next(iter(read_json(SALT / "optimise" / "optimum.json")["optimum"]))
    (folder / "optimum.json").write_text(
        f'{{"optimum": {{"{name}": 0.125, "own": 0.5}}, "target": 45.26}}'
    )
    return folder.parent, name


def test_a_study_beside_itself_has_the_same_on_both_sides():
    found = rows_of(compare(SALT, SALT))
    optimum = read_json(SALT / "optimise" / "optimum.json")["optimum"]
    for title, rows in found.items():
        for key, (ours, theirs) in rows.items():
            assert ours == theirs or "apart" in key, title
    text = " ".join(cell for cells in found["Parameters"].values() for cell in cells)
    for value in optimum.values():
        assert f"{value:.4g}" in text
    apart = [float(v[0]) for k, v in found["Parameters"].items() if "apart" in k]
    assert set(apart) == {0.0}


def test_what_only_one_study_has_stands_alone(other):
    folder, shared = other
    found = rows_of(compare(SALT, folder))
    words = label(shared)
    assert found["Parameters"][words][1] == "0.125"
    assert found["Parameters"]["own"] == (NONE, "0.5")
    assert found["Validation"]["simulated"][1] == NONE
    assert found["Response surface"]["R²"][1] == NONE


def test_a_folder_without_a_calibrated_point_is_refused(tmp_path, capsys):
    with refused(CalibrationError, "optimise"):
        compare(SALT, tmp_path)
    assert main(["compare", str(SALT), str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err


def test_the_page_is_written_whole(tmp_path, other):
    out = tmp_path / "page.md"
    assert main(["compare", str(SALT), str(other[0]), "--out", str(out)]) == 0
    assert out.read_text() == compare(SALT, other[0])
