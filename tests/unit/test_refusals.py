"""What people hand in is refused in one sentence that names the place and what is right; what has
one meaning is read and said back. None passes in silence."""

import shlex
from pathlib import Path

import pytest
import yaml
from refusals import (
    CASES,
    CONFIGURATION,
    FACTORS,
    HANDED_IN,
    MEASURED,
    OPTIONS,
    RUN,
    TEXTS,
    WRITTEN,
)  # fmt: skip

from calibration.engines.command import read_metrics
from calibration.engines.table import read_row
from calibration.errors import CalibrationError, ConfigError
from calibration.intake.photo import measure_photo
from calibration.intake.shear_tester import read_points
from calibration.intake.sound import read_train
from calibration.interface import cli
from calibration.interface.commands import main
from calibration.stages.numerics import read_numerics
from calibration.statistics.design import screening_design
from calibration.study.config import overlay, parse_config, read_back
from calibration.study.config.as_data import data_of
from calibration.study.config.schema import ScreeningConfig
from calibration.study.factors import read_factors
from calibration.study.new.grains import sieve_curve
from dem.errors import DemError
from dem.io.grain_tables import read_clump, read_sizes
from dem.io.stl import read_stl
from dem.spec import load_spec
from dem.tables import read_table
from facts import ROOT, holds, refused, tells

SALT = [f.name for f in read_factors(ROOT / "config/factors.tsv")]
LONGEST = 1500
"""Characters of a refusal."""


def read_study(_):
    """Read the study in the working directory, as snakemake reads it."""
    with Path("config.yaml").open(encoding="utf-8") as stream:
        data = data_of(stream)
    if not isinstance(data, dict):
        raise ConfigError("is no mapping", allowed="a mapping")
    return parse_config(data, files=["config.yaml"])


READERS = {
    "configuration": ("config.yaml", read_study),
    "factors": ("factors.tsv", read_study),
    "measured table": ("measured.csv", read_study),
    "run spec": ("nonsense.yaml", load_spec),
    "shear tester": ("nonsense.csv", read_points),
    "design": ("nonsense.csv", lambda p: screening_design(
        read_factors("factors.tsv"), ScreeningConfig(design=str(p)))),
    "sieve table": ("nonsense.csv", sieve_curve),
    "sizes": ("nonsense.csv", lambda p: read_sizes(p, "mass")),
    "clump": ("nonsense.csv", read_clump),
    "STL": ("nonsense.stl", lambda p: read_stl(p, closed=True)),
    "numerics": ("nonsense.yaml", lambda p: read_numerics(p, SALT)),
    "responses": ("nonsense.csv", lambda p: read_row(p, RUN)),
    "metrics": ("nonsense.json", read_metrics),
    "workbook": ("nonsense.xlsx", lambda p: read_table(p).numbers("value")),
    "photograph": ("nonsense.png", measure_photo),
    "sound": ("nonsense.wav", read_train),
}  # fmt: skip
"""Kind: (its name, what reads it)."""


def changed(text, old, new):
    """A sound text with one thing changed."""
    assert old in text
    return text.replace(old, new, 1) if old else f"{text}{new}\n"


def read(kind, write):
    """Read a file of a kind, beside the tables of a study."""
    name, reader = READERS[kind]
    for other, text in (("config.yaml", CONFIGURATION), ("factors.tsv", FACTORS),
                        ("measured.csv", MEASURED)):  # fmt: skip
        Path(other).write_text(text)
    write(Path(name))
    reader(Path(name))


@pytest.mark.parametrize("kind", READERS)
def test_a_file_is_refused_with_its_place_and_what_is_right(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cases = [
        (fault, lambda p, o=old, n=new: p.write_text(changed(TEXTS[kind], o, n)), named)
        for fault, old, new, *named in CASES.get(kind, ())
    ]
    cases += [(fault, write, named) for fault, write, *named in WRITTEN.get(kind, ())]
    wrong = []
    for fault, write, named in cases:
        said = ""
        try:
            read(kind, write)
        except (CalibrationError, DemError) as error:
            said = str(error)
        missing = [name for name in named if not holds(said, name)]
        if not 0 < len(said) <= LONGEST or missing or (kind in TEXTS and "\n" in said):
            wrong.append(f"{fault}: {said}; not named: {missing}")
    assert cases
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("kind", [k for k in TEXTS if k != "STL"])  # that one is open
def test_the_file_that_is_changed_is_sound(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    read(kind, lambda path: path.write_text(TEXTS[kind]))


@pytest.mark.parametrize("case", OPTIONS, ids=[case[0] for case in OPTIONS])
def test_an_option_is_refused_and_nothing_is_left_behind(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("taken").mkdir()
    for name, text in HANDED_IN.items():
        Path(name).write_text(text)
    _, line, *named = case
    pilot = [] if "--table" in line else ["--no-pilot"]
    try:
        status = main(["new", *shlex.split(line), *pilot])
    except SystemExit as end:
        status = end.code
    said = capsys.readouterr().err
    assert status == 2
    assert [name for name in named if not holds(said, name)] == [], said
    assert not Path("w").exists()
    assert "w/" not in said  # no file that is gone


def readings(*values, unit="deg"):
    """Readings of a heap's angle as the table that a study names."""
    rows = [f"heap,angle_of_repose,{v},{unit}\n" for v in values]
    return "experiment,quantity,value,unit\n" + "".join(rows)


FOUR = readings("26.1", "28.4", "27.0", "28.1")
GERMAN = FOUR.replace(",", ";").replace(".", ",").replace("unit", "unit;note")
GERMAN = GERMAN.replace("deg", "deg;Schüttung")
READ_RIGHTLY = {
    "semicolons and decimal commas": (GERMAN, "semicolon-separated, decimal commas"),
    "letters of cp1252": (GERMAN.encode("cp1252"), "cp1252"),
    "a unit in the heading": (
        readings("26.1", "28.4", "27.0", "28.1", unit="").replace("ue", "ue [deg]"), ""),
    "degrees behind the values": (readings("26.1°", "28.4 deg", "27.0°", "28.1"), ""),
}  # fmt: skip


@pytest.mark.parametrize("name", READ_RIGHTLY)
def test_what_has_one_meaning_is_read_and_said_back(name, tmp_path, monkeypatch):
    """Under a path with a space and an umlaut, with a density in kg per litre and its unit."""
    (tmp_path / "Weizen Prüfung 1").mkdir()
    monkeypatch.chdir(tmp_path / "Weizen Prüfung 1")
    content, words = READ_RIGHTLY[name]
    Path("measured.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    Path("factors.tsv").write_text(FACTORS)
    Path("config.yaml").write_text(CONFIGURATION.replace("1350", "1.35 kg/l"))
    config = read_study(None)
    (said,) = read_back(config)
    assert "4 values, 26.1° to 28.4°, mean 27.40°" in said
    assert words in said
    assert config.own_run["materials"]["particle"]["density_kg_m3"] == 1350


def test_an_error_names_the_file_that_has_it(tmp_path, monkeypatch):
    """Of several files that are laid over each other, and of the command line."""
    monkeypatch.chdir(tmp_path)
    Path("factors.tsv").write_text(FACTORS)
    Path("measured.csv").write_text(MEASURED)
    Path("below.yaml").write_text(CONFIGURATION)
    Path("mine.yaml").write_text("# my own changes\nascent:\n  start: { nobody: 1 }\n")
    mine, below = (yaml.safe_load(Path(f"{n}.yaml").read_text()) for n in ("mine", "below"))
    with refused(ConfigError, path="mine.yaml", line=3):
        parse_config(overlay(below, mine), files=["below.yaml", "mine.yaml"])
    below["screening"]["runs"] = 12.5
    Path("below.yaml").write_text(CONFIGURATION.replace("runs: 12", "runs: 12.5"))
    with refused(ConfigError, path="below.yaml", line=11, key="screening.runs", value=12.5):
        parse_config(overlay(below, {"seed": 3}), files=["below.yaml", "mine.yaml"])
    below["screening"]["runs"] = -5
    with refused(ConfigError, path="--config", key="screening.runs", value=-5):
        parse_config(below, files=["below.yaml"])


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A sound study in the folder `wheat`."""
    monkeypatch.chdir(tmp_path)
    Path("wheat").mkdir()
    text = CONFIGURATION.replace(": factors", ": wheat/factors").replace(": meas", ": wheat/meas")
    for name, content in (("config.yaml", text), ("factors.tsv", FACTORS),
                          ("measured.csv", MEASURED)):  # fmt: skip
        Path("wheat", name).write_text(content)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["screning"], ["screning", "stage", "screening"]),
        (["--config", "resolution=quick", "screening"], ["screening", "--config", "KEY=VALUE"]),
    ],
)
def test_a_mistake_on_the_command_line_is_told_before_anything_is_planned(
    study, words, named, capsys
):
    assert cli.main(["run", "wheat", "-n", "-j2", *words]) == 2
    said = capsys.readouterr().err
    assert tells(said, *named)
    assert len(said) < 200
