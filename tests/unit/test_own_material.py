"""A study's material in the folder's library, and a study under another name."""

from pathlib import Path

import pandas as pd
import pytest
import yaml

from calibration.interface.api import Study
from calibration.interface.cli import main as calibration
from calibration.interface.commands import main as dem
from calibration.study.config import parse_config
from calibration.study.factors import read_factors

NEW = (
    "--lifted-cylinder 26.1 27.4 cylinder=60mm depth=60mm speed=20mm/s --density 1.32g/cm3 "
    "--axes 6.2x3.3x2.9mm --no-pilot"
).split()


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert dem(["new", "wheat", *NEW]) == 0
    return tmp_path


def posterior(folder, stage="joint"):
    """Intervals as the stage leaves them: two of them bounded."""
    names = [f.name for f in Study("wheat").factors]
    table = pd.DataFrame({"parameter": names, "low": 0.301234, "high": 0.4, "bounded": False})
    table.loc[table.parameter.isin(names[3:5]), "bounded"] = True
    (folder / stage).mkdir(parents=True)
    table.to_csv(folder / stage / "parameters.csv", index=False)
    return names[3:5]


def test_a_kept_material_is_offered_to_the_next_study(here, capsys):
    bounded = posterior(Path("results/wheat"))
    assert calibration(["keep", "wheat"]) == 2  # wheat has published ranges
    assert "wheat" in capsys.readouterr().err
    assert calibration(["keep", "wheat", "--as", "my wheat"]) == 0
    assert dem(["new", "next", *NEW, "--material", "my wheat"]) == 0
    factors = {f.name: f for f in read_factors("next/factors.tsv")}
    for name in bounded:
        assert (factors[name].low, factors[name].high) == (0.3012, 0.4)
        assert "results/wheat, stage joint" in factors[name].description
    assert "wide" in factors["grain_wall_restitution"].description
    assert calibration(["keep", "wheat", "--as", "my wheat"]) == 2
    assert calibration(["keep", "wheat", "--as", "other"]) == 0
    assert set(pd.read_csv("materials.csv").material) == {"my wheat", "other"}


def test_a_study_without_a_posterior_keeps_nothing(here, capsys):
    assert calibration(["keep", "wheat", "--as", "mine"]) == 2
    assert "has no posterior" in capsys.readouterr().err
    posterior(Path("results/wheat-quick"), "posterior")
    assert calibration(["keep", "wheat", "--as", "mine", "--results", "results/wheat-quick"]) == 0


def test_a_library_with_a_wrong_number_is_told_by_line(here, capsys):
    Path("materials.csv").write_text(
        "material,key,low,high,source\nmine,contacts.particle_wall.restitution,wide,0.5,me\n"
    )
    assert dem(["new", "next", *NEW, "--material", "mine"]) == 2
    said = capsys.readouterr().err
    assert "materials.csv" in said
    assert "line 2" in said
    assert not Path("next").exists()


def test_a_copy_is_the_same_study_under_another_name(here, capsys):
    assert calibration(["copy", "wheat", "Weizen 2"]) == 0
    first, second = (
        parse_config(yaml.safe_load(Path(n, "config.yaml").read_text()))
        for n in ("wheat", "Weizen 2")
    )
    assert second.name == "Weizen_2"
    for text in (Path("Weizen 2/config.yaml"), Path("Weizen 2/README.md")):
        assert "wheat/" not in text.read_text()
    assert second.measurements == "Weizen 2/measured.csv"
    assert Path("Weizen 2/clump.csv").read_bytes() == Path("wheat/clump.csv").read_bytes()
    # the same grains: a run is named after them, not after the table's path
    from calibration.study.config import point_spec
    from dem.results import run_name
    from dem.spec import parse_spec

    names = {run_name(parse_spec(point_spec(c.run, c.experiment, {}, 1))) for c in (first, second)}
    assert len(names) == 1
    assert calibration(["copy", "wheat", "Weizen 2"]) == 2
    assert calibration(["copy", "none", "other"]) == 2
    assert not Path("other").exists()


@pytest.mark.parametrize(
    "text", ["", "- 1\n", "name: a\nx: [[\n", "name: a\nx: !!python/name:os.system\n", "name: \xff"]
)
def test_what_is_no_configuration_is_told_by_every_command(here, text, capsys):
    Path("odd").mkdir()
    Path("odd/config.yaml").write_bytes(text.encode("latin-1"))
    for words in (["copy", "odd", "new"], ["allow", "odd"], ["keep", "odd"], ["run", "odd", "-n"]):
        assert calibration(words) == 2
        assert "odd/config.yaml" in capsys.readouterr().err
    assert not Path("new").exists()
