"""The mechanism that docs/extend.md shows: its file registers from a folder and finds what it
claims to find."""

from pathlib import Path

import numpy as np
import pytest

from diagnosis.catalogue import Mechanism, load_catalogue

SHIPPED = Path("src/diagnosis/catalogue/uncounted_load.py")
CODE = SHIPPED.read_text()


@pytest.fixture
def folder(tmp_path):
    """A folder with the file, its mechanism under another name than the catalogue's."""
    (tmp_path / "my_load.py").write_text(CODE.replace('"uncounted_load"', '"my_load"'))
    return tmp_path


def test_a_file_in_a_folder_joins_the_catalogue(folder):
    known = load_catalogue(folder=folder)
    assert set(known) == set(load_catalogue()) | {"my_load"}
    assert isinstance(known["my_load"], Mechanism)
    assert "my_load" not in load_catalogue(without=["my_load"], folder=folder)


def test_a_tenth_of_a_kilopascal_gives_the_intercept_that_the_page_says(folder):
    load = load_catalogue(folder=folder)["my_load"]
    normal = np.array([1.0, 4.0, 8.0])
    read = [load.observe(0.845 * s, {"normal_stress_kPa": s}, 0.1) for s in normal]
    slope, intercept = np.polyfit(normal, read, 1)
    assert (slope, intercept) == pytest.approx((0.845, 0.0845))
    spec = {"experiment": "shear", "geometry": {"normal_stress_kPa": 2.0}}
    assert load.apply(spec, 0.1)["geometry"]["normal_stress_kPa"] == 2.1
    assert spec["geometry"]["normal_stress_kPa"] == 2.0
