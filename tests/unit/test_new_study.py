"""The files that begin a study are whole: only the measured values are missing."""

import pytest
import yaml

from calibration.config import Config, parse_config, section_of
from calibration.errors import ConfigError
from calibration.new_study import FACTORS, SECTIONS, main
from dem.spec import parse_spec


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["peas"]) == 0
    return tmp_path / "peas"


def test_only_the_measured_values_are_missing(folder):
    data = yaml.safe_load((folder / "config.yaml").read_text())
    with pytest.raises(ConfigError, match=r"measured\.csv: needs at least two values"):
        parse_config(data)
    with open(folder / "measured.csv", "a") as stream:
        stream.write("27.1\n28.0\n")
    config = parse_config(data)
    assert config.name == "peas"
    assert set(config.fixed) == {f.name for f in FACTORS}


def test_every_key_is_there_with_its_default_and_a_comment(folder):
    text = (folder / "config.yaml").read_text()
    data = yaml.safe_load(text)
    changed = {"file", "column", "rule"}
    for name in SECTIONS:
        for key, field in section_of(Config.model_fields[name].annotation).model_fields.items():
            value = field.get_default(call_default_factory=True)
            assert key in changed or data[name][key] == value
    settings = [x for x in text.splitlines() if ": " in x and not x.lstrip().startswith("#")]
    assert all("#" in line for line in settings)
    written = parse_spec({"experiment": "heap"} | data["run"])
    assert written == parse_spec({"experiment": "heap"})


def test_a_folder_that_exists_is_left_alone(folder, capsys):
    before = (folder / "config.yaml").read_text()
    assert main(["peas"]) == 2
    assert "exists" in capsys.readouterr().err
    assert (folder / "config.yaml").read_text() == before
