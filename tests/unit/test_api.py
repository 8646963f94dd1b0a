"""The public interface: a study opened by its folder, its results as tables with units, the
README's lines."""

import json
import sys
from functools import partial
from pathlib import Path
from subprocess import CompletedProcess

import pandas as pd
import pytest

from calibration import Study
from calibration.errors import CalibrationError, ConfigError
from calibration.interface import api
from calibration.runs.snakemake_command import WORKFLOW, call
from facts import ROOT, refused, tells
from frozen import FROZEN

Ended = partial(CompletedProcess, "snakemake")


@pytest.fixture
def soybean(with_data):
    """The soybean study with a screening's table as another program would have written it."""
    folder = with_data / "results" / "soybean" / "screening"
    folder.mkdir(parents=True)
    table = pd.DataFrame({"code": ["A", "B"], "effect": [10.6, -3.5], "p": [0.0001, 0.008]})
    table.to_csv(folder / "effects.csv", index=False)
    summary = json.loads((FROZEN / "salt" / "screening" / "screening.json").read_text())
    summary |= {"significant": ["<b>"], "effects": {"<b>": 10.6}, "p": {"<b>": 0.0001}}
    (folder / "screening.json").write_text(json.dumps(summary))
    return Study("examples/soybean")


def test_a_study_is_opened_by_its_folder_or_its_file(soybean):
    assert soybean.name == "soybean"
    assert Study("examples/soybean/config.yaml").config == soybean.config
    assert [f.code for f in soybean.factors] == list("ABCDEFG")
    assert list(soybean.measured()) == [26.35, 30.0]
    with refused(ConfigError, path="wheat", allowed="a folder with config.yaml, or a file"):
        Study("wheat")


def test_tables_bear_their_units(soybean):
    table = soybean.table("screening", "effects")
    assert table.attrs["units"] == {"effect": "°"}
    assert list(table["effect"]) == [10.6, -3.5]
    assert soybean.table("screening", "nothing") is None


def test_a_study_and_its_stage_are_printed_with_what_was_found(soybean):
    shown = str(soybean)
    assert "object at" not in shown
    assert tells(shown, "Study", "soybean", "results/soybean")
    assert tells(shown, "Screening", "<b>", "+10.6°")
    assert tells(shown, "not yet", "Validation")
    kept = pd.read_csv(ROOT / "results/reference/salt/screening/effects.csv")
    kept.to_csv(soybean.folder / "screening" / "effects.csv", index=False)
    stage, first = soybean.results("screening"), kept.iloc[0]
    found = str(stage).partition("effects")[2]
    for text in ("name", first["name"], f"{first.effect:.4g}", "p", f"{first.p:.4g}"):
        assert text in found
    assert "..." not in found
    assert repr(float(first.p)) not in found
    assert soybean.table("screening", "effects")["p"][0] == first.p


@pytest.mark.parametrize("own", [True, False], ids=["in a clone", "elsewhere"])
def test_a_stage_is_run_by_the_folder_s_workflow_or_else_the_package_s(own, soybean, monkeypatch):
    if own:
        Path("Snakefile").touch()
    monkeypatch.setattr(api, "call", lambda command, **_: asked.append(command) or Ended(0))
    asked = []
    soybean.run("screening")
    [command] = asked
    named = command[command.index("--snakefile") + 1]
    assert named == ("Snakefile" if own else str(WORKFLOW / "Snakefile"))
    assert command[-2:] == ["-j2", "screening"]
    assert Path(named).is_file()


def test_figures_are_shown_by_name_or_all_of_a_stage(soybean):
    with refused(CalibrationError, "screening"):
        soybean.plot("screening")
    for name in ("pareto", "half_normal"):
        (soybean.folder / "screening" / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    assert soybean.plot("screening", "pareto")._repr_html_() == "<svg>pareto</svg>"
    assert soybean.plot("screening")._repr_html_() == "<svg>half_normal</svg><svg>pareto</svg>"
    with refused(CalibrationError, "screening", "surface", "half_normal", "pareto"):
        soybean.plot("screening", "surface")
    with pytest.raises(CalibrationError) as told:
        soybean.plot("screning")
    assert tells(str(told.value), "screning", "stage", "screening")


def test_lines_are_told_while_the_command_runs(tmp_path):
    """The first line arrives while the command still runs: it waits for what the line brings."""
    go, told = tmp_path / "go", []
    program = (
        "import pathlib, time, sys\n"
        "print('first', flush=True)\n"
        f"while not pathlib.Path({str(go)!r}).exists(): time.sleep(0.01)\n"
        "print('second', file=sys.stderr)\n"
        "sys.exit(3)"
    )

    def each(line):
        told.append(line)
        go.touch()

    done = call([sys.executable, "-c", program], each=each)
    assert (told, done.returncode) == (["first", "second"], 3)
    assert done.stdout.split() == told
