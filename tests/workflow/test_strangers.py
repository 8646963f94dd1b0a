"""A configuration from elsewhere runs nothing, not even in a dry run."""

import json
import sys

import pytest
import yaml
from deployed import done, write_study

from calibration.errors import ConfigError
from calibration.study.config.as_data import data_of
from facts import ROOT, refused, tells
from started import python

DEFINES = """
name: elsewhere
__use_yte__: true
__definitions__:
  - import pathlib
  - pathlib.Path("created").touch()
"""
EVALUATES = """
__use_yte__: true
name: ?__import__("pathlib").Path("created").touch()
"""
BRANCHES = """
__use_yte__: true
run:
  ?if __import__("pathlib").Path("created").touch() is None:
    seed: 1
"""
CODE = {"definitions": DEFINES, "an expression": EVALUATES, "a branch": BRANCHES}


def dry_run(folder, *arguments):
    for name in ("Snakefile", "workflow", "config", "profiles", "src", "data"):
        (folder / name).symlink_to(ROOT / name)
    done = python(folder, *"-m snakemake -n -j1".split(), *arguments, status=None)
    return done, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("text", "profile"),
    [
        pytest.param(EVALUATES, (), marks=pytest.mark.slow),
        (DEFINES, ("--profile", "profiles/test")),
    ],
    ids=["an expression", "another profile"],
)
def test_code_in_a_configuration_is_not_run(tmp_path, text, profile):
    (tmp_path / "evil.yaml").write_text(text)
    done, shown = dry_run(tmp_path, *profile, "--configfile", "evil.yaml")
    assert done.returncode != 0
    assert tells(shown, "evil.yaml, line", "code")
    assert "Traceback" not in shown
    assert not (tmp_path / "created").exists()


@pytest.mark.slow
def test_an_engine_s_command_is_not_run_until_it_is_allowed(tmp_path):
    """Refused with what to type; what is typed is remembered."""
    write_study(tmp_path / "bounce", may_start=False)
    planned = [sys.executable, "-m", "snakemake", "-n", "-j1", "-s", ROOT / "workflow/Snakefile"]
    planned += ["--configfile", "bounce/config.yaml", "--", "screening"]
    with refused(AssertionError, "engine.command", "calibration allow bounce/config.yaml"):
        done(*planned, cwd=tmp_path)
    done(sys.executable, "-m", "calibration.interface.cli", "allow", "bounce", cwd=tmp_path)
    done(*planned, cwd=tmp_path)


@pytest.mark.slow
def test_the_command_line_s_own_command_runs_a_study(tmp_path):
    """Braces and quotation marks reach the jobs as they were typed."""
    config = yaml.safe_load(write_study(tmp_path / "bounce", may_start=False).read_text())
    value = json.dumps({"command": config["engine"]["command"]})
    made = [sys.executable, "-m", "snakemake", "-j1", "-s", ROOT / "workflow/Snakefile"]
    made += ["--configfile", "bounce/config.yaml", "--config", f"engine={value}"]
    done(*made, "--", "plan_screening", cwd=tmp_path)
    assert (tmp_path / "results/drops/screening/plan.json").is_file()


@pytest.mark.parametrize("text", CODE.values(), ids=CODE)
def test_what_would_be_evaluated_is_refused(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    with refused(ConfigError) as told:
        data_of(text)
    assert told.value.key
    assert not (tmp_path / "created").exists()


def test_plain_data_are_read_as_they_are():
    text = "a: [1, {b: 'what?'}]\nc: {d: 1.5e-3, e: null}\n"
    assert data_of(text) == {"a": [1, {"b": "what?"}], "c": {"d": 1.5e-3, "e": None}}
