"""What people really hand in: each mistake gets a sentence with file, line, value and what is
allowed, or is read
rightly and said back. None passes silently."""

import pytest
import yaml

from calibration.errors import ConfigError
from calibration.interface import cli
from calibration.interface.cli import main
from calibration.study.config import parse_config, read_back
from facts import tells


def table_of(*values, unit="deg"):
    """Readings of a heap's angle as the table that a study names."""
    rows = [f"heap,angle_of_repose,{v},{unit}\n" for v in values]
    return "experiment,quantity,value,unit\n" + "".join(rows)


MEASURED = table_of("26.1", "28.4", "27.0", "28.1")
HEADER = "code\tname\tkey\tlow\thigh\n"
FACTORS = (
    HEADER
    + "A\tgrain_friction\tcontacts.particle_particle.static_friction\t0.2\t0.8\n"
    + "B\tgrain_rolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\n"
    + "C\tgrain_restitution\tcontacts.particle_particle.restitution\t0.2\t0.8\n"
)
CONFIG = """\
name: wheat
factors: {folder}/factors.tsv
measurements: {folder}/{file}
target:
  metric: angle_of_repose_deg
fixed:
  grain_friction: 0.5
run:
  materials:
    particle: {{ density_kg_m3: 1350 }}
  particles:
    diameter_mm: 4
"""


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A sound study in a folder whose name has a space and an umlaut; returns what parses it after
    a change."""
    folder = tmp_path / "Weizen Prüfung 1"
    folder.mkdir()
    monkeypatch.chdir(tmp_path)

    def parse(measured=MEASURED, factors=FACTORS, config=CONFIG, file="measured.csv"):
        content = measured if isinstance(measured, bytes) else measured.encode()
        (folder / file).write_bytes(content)
        (folder / "factors.tsv").write_bytes(factors.encode())
        path = folder / "config.yaml"
        path.write_text(config.format(folder=folder.name, file=file))
        return parse_config(yaml.safe_load(path.read_text()), files=[path])

    return parse


GERMAN = MEASURED.replace(",", ";").replace(".", ",").replace("unit", "unit;note")
GERMAN = GERMAN.replace("deg", "deg;Schüttung")


READ_RIGHTLY = {
    "a sound study under a path with a space and an umlaut": ({}, ""),
    "semicolons and decimal commas": ({"measured": GERMAN}, "semicolon-separated, decimal commas"),
    "tabs": ({"measured": GERMAN.replace(";", "\t")}, "tab-separated, decimal commas"),
    "Windows line ends": ({"measured": GERMAN.replace("\n", "\r\n")}, "semicolon"),
    "a unit in the heading": (
        {"measured": table_of("26.1", "28.4", "27.0", "28.1", unit="").replace("ue", "ue [deg]")},
        "",
    ),
    "UTF-16 of a spreadsheet": ({"measured": GERMAN.encode("utf-16")}, "utf-16"),
    "a byte order mark": ({"measured": b"\xef\xbb\xbf" + GERMAN.encode()}, "semicolon"),
    "letters of cp1252": (
        {"measured": GERMAN.encode("cp1252")},
        "cp1252",
    ),
    "a comment in front": ({"measured": "# gemessen\n" + MEASURED}, ""),
    "degrees behind the values": (
        {"measured": table_of("26.1°", "28.4 deg", "27.0°", "28.1")},
        "",
    ),
    "a density in kg per litre, with its unit": (
        {"config": CONFIG.replace("1350", "1.35 kg/l")},
        "",
    ),
}


@pytest.mark.parametrize("name", READ_RIGHTLY)
def test_what_has_one_meaning_is_read_and_said_back(study, name):
    change, words = READ_RIGHTLY[name]
    config = study(**change)
    (said,) = read_back(config)
    assert "4 values, 26.1° to 28.4°, mean 27.40°" in said
    assert words in said
    assert config.run["materials"]["particle"]["density_kg_m3"] == 1350


def row(text):
    """The factor table with its first row replaced."""
    lines = FACTORS.splitlines(keepends=True)
    return lines[0] + text.replace(" ", "\t") + "\n" + "".join(lines[2:])


KEY = "contacts.particle_particle.static_friction"

REFUSED = {
    "radians": (
        {"measured": table_of("0.46", "28.4", unit="")},
        ["line 2", "column value", "'0.46'", "0.46 rad (26.36 °)", "allowed: a plausible"],
    ),
    "a lost decimal point": (
        {"measured": MEASURED.replace("28.4", "284")},
        ["line 3", "column value", "284", "0.1 to 89"],
    ),
    "one value": ({"measured": table_of("26.1")}, ["measured.csv", "at least two values"]),
    "a missing column": (
        {"measured": MEASURED.replace("value", "valeu")},
        ["measured.csv, line 1", "column value", "is missing", "valeu"],
    ),
    "a misspelt quantity": (
        {"measured": MEASURED.replace("28.4", "28.4").replace("repose,28.4", "reposse,28.4")},
        ["line 3", "column quantity", "'angle_of_reposse'", "allowed: angle_of_repose, "],
    ),
    "a file for each target": (
        {"config": CONFIG.replace("metric: angle_of_repose_deg", "file: angles.csv")},
        ["config.yaml, line 5", "target.file", "allowed: a row a reading", "`measurements`"],
    ),
    "a mean and its readings": (
        {
            "measured": "experiment,quantity,value,unit,sd,n\nheap,angle_of_repose,26,deg,1,5\n"
            "heap,angle_of_repose,27,deg,,\n"
        },
        ["line 3", "repeats the condition of line 2", "each as a row without sd and n"],
    ),
    "low and high swapped": (
        {"factors": row(f"A grain_friction {KEY} 0.8 0.2")},
        ["factors.tsv, line 2", "column high", "0.2", "more than 0.8"],
    ),
    "a factor table with commas in numbers and points": (
        {"factors": row(f"A grain_friction {KEY} 0,2 0.8")},
        ["factors.tsv, line 2", "0,2", "0.8 on line 2"],
    ),
    "a column of the factors missing": (
        {"factors": FACTORS.replace("high", "upper")},
        ["factors.tsv, line 1", "lacks high", "allowed: the columns code"],
    ),
    "a factor of a misspelt key": (
        {"factors": row("A grain_friction contacts.particle_particle.static_fricton 0.2 0.8")},
        ["factors.tsv", "static_fricton", "static_friction"],
    ),
    "a factor that is not there": (
        {"config": CONFIG.replace("grain_friction", "grain_frction")},
        ["config.yaml, line 7", "grain_frction", "allowed: grain_friction"],
    ),
    "a misspelt key": (
        {"config": CONFIG.replace("diameter_mm", "diametre_mm")},
        ["config.yaml, line 12", "diametre_mm", "diameter_mm"],
    ),
    "kg per litre": (
        {"config": CONFIG.replace("1350", "1.35")},
        ["config.yaml, line 10", "1.35 g/cm³ (1350 kg/m³)", "allowed: a plausible"],
    ),
    "a decimal comma in the configuration": (
        {"config": CONFIG.replace("diameter_mm: 4", "diameter_mm: 4,2")},
        ["config.yaml, line 12", "'4,2'", "number"],
    ),
    "metres": (
        {"config": CONFIG.replace("diameter_mm: 4", "diameter_mm: 0.0038")},
        ["config.yaml, line 12", "0.0038 m (3.8 mm)"],
    ),
    "a mass for a length": (
        {"config": CONFIG.replace("diameter_mm: 4", "diameter_mm: 4 kg")},
        ["config.yaml, line 12", "'4 kg'", "another kind", "allowed: mm"],
    ),
    "a modulus of ten pascals": (
        {
            "config": CONFIG.replace(
                "density_kg_m3: 1350", "density_kg_m3: 1350, shear_modulus_Pa: 10"
            )
        },
        ["config.yaml, line 10", "shear_modulus_Pa", "10 MPa", "allowed: a plausible"],
    ),
    "a file that is not there": (
        {"config": CONFIG.replace("{file}", "mesured.csv")},
        ["mesured.csv: cannot be read"],
    ),
    "a folder in place of a file": (
        {"config": CONFIG.replace("/{file}", "")},
        ["Weizen Prüfung 1: cannot be read"],
    ),
    "a name with a space": (
        {"config": CONFIG.replace("name: wheat", "name: my wheat")},
        ["config.yaml, line 1", "'my wheat'", "allowed: "],
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_mistake_gets_a_sentence(study, name):
    change, words = REFUSED[name]
    with pytest.raises(ConfigError) as error:
        study(**change)
    said = str(error.value)
    for word in words:
        assert word in said
    assert "\n" not in said
    assert len(said) < 600


@pytest.mark.parametrize(("word", "meant"), [("screning", "screening"), ("optimize", "optimise")])
def test_a_misspelt_stage_is_named_before_anything_is_planned(study, word, meant, capsys):
    study()
    assert main(["run", "Weizen Prüfung 1", "-n", "-j2", word]) == 2
    assert tells(capsys.readouterr().err, word, "stage", meant)


@pytest.mark.parametrize(
    ("option", "hint"), [("--fast", "--help"), ("--dry-rum", "--dry-run"), ("--tuch=1", "--touch")]
)
def test_an_option_that_is_not_there_is_no_page_of_options(
    study, option, hint, capsys, monkeypatch
):
    monkeypatch.setattr(cli, "option_names", lambda: {"--dry-run", "--touch", "--list-rules"})
    study()
    assert main(["run", "Weizen Prüfung 1", "-n", option]) == 2
    said = capsys.readouterr().err
    assert tells(said, option.partition("=")[0], hint)
    assert len(said) < 100


@pytest.mark.parametrize("option", ["--config", "-C"])
def test_a_stage_behind_the_settings_is_no_setting(study, option, capsys):
    study()
    words = ["-n", "-j2", option, "resolution=quick", "screening"]
    assert main(["run", "Weizen Prüfung 1", *words]) == 2
    assert tells(capsys.readouterr().err, "screening", "--config", "KEY=VALUE")
