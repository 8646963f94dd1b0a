"""The mechanism that docs/extend.md shows: its file registers from a folder and finds what it
claims to find."""

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import bench

from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement
from diagnosis.catalogue import Mechanism, load_catalogue
from diagnosis.identify import identify
from diagnosis.model import Emulated
from facts import refused

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


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("x = 1", {"allowed": "MECHANISM = Mechanism(...)"}),
        ("import no_such_module", {"line": None, "key": None}),
        (CODE, {"key": "name", "value": "uncounted_load"}),
    ],
)
def test_a_file_that_defines_no_new_mechanism_is_named(tmp_path, text, facts):
    (tmp_path / "bad.py").write_text(text)
    with refused(ConfigError, path="bad.py", **facts):
        load_catalogue(folder=tmp_path)


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with refused(ConfigError, path="none", key="diagnosis.catalogue"):
        load_catalogue(folder=tmp_path / "none")


def test_a_tenth_of_a_kilopascal_gives_the_intercept_that_the_page_says(folder):
    load = load_catalogue(folder=folder)["my_load"]
    normal = np.array([1.0, 4.0, 8.0])
    read = [load.observe(0.845 * s, {"normal_stress_kPa": s}, 0.1) for s in normal]
    slope, intercept = np.polyfit(normal, read, 1)
    assert (slope, intercept) == pytest.approx((0.845, 0.0845))
    spec = {"experiment": "shear", "geometry": {"normal_stress_kPa": 2.0}}
    assert load.apply(spec, 0.1)["geometry"]["normal_stress_kPa"] == 2.1
    assert spec["geometry"]["normal_stress_kPa"] == 2.0


def test_without_the_mechanism_the_hidden_load_passes_for_cohesion(folder):
    emulated = bench(
        ["shear"],
        {"catalogue": str(folder), "experiments": {"shear": {"mechanisms": ["cohesion"]}}},
    )
    rng = np.random.default_rng(4)
    hidden = emulated.catalogue["my_load"].observe
    data = []
    for stress in np.arange(1.0, 9.0):
        condition = {"normal_stress_kPa": float(stress)}
        value = hidden(0.845 * stress, condition, 0.1)
        value *= 1.0 + 0.02 / np.sqrt(5) * rng.standard_normal()
        data.append(Measurement("shear", value, 0.02 * value, 5, condition))

    def found(*without):
        known = {k: v for k, v in emulated.catalogue.items() if k not in without}
        less = Emulated(emulated.emulators, emulated.settings, emulated.factors, known)
        return identify(less, data, replicates=100, seed=1)

    with_it = found("uncounted_load")
    assert with_it.verdict == "ambiguous"
    assert set(with_it.causes) == {"my_load", "cohesion"}
    [own] = [r for r in with_it.ranking if r["mechanism"] == "my_load"]
    assert own["strength"]["my_load"]["value"] == pytest.approx(0.1, abs=0.03)
    assert found("uncounted_load", "my_load").causes == ["cohesion"]
