"""A configuration from elsewhere runs nothing, not even in a dry run."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from deployed import done, write_study

from calibration.errors import ConfigError
from calibration.study.config.as_data import data_of
from facts import refused, tells

ROOT = Path(__file__).parents[2]

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
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "-n", "-j1", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    return done, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("text", "profile"),
    [(DEFINES, ()), (EVALUATES, ()), (DEFINES, ("--profile", "profiles/test"))],
    ids=["definitions", "an expression", "another profile"],
)
def test_code_in_a_configuration_is_not_run(tmp_path, text, profile):
    (tmp_path / "evil.yaml").write_text(text)
    done, shown = dry_run(tmp_path, *profile, "--configfile", "evil.yaml")
    assert done.returncode != 0
    assert tells(shown, "evil.yaml, line", "code")
    assert "Traceback" not in shown
    assert not (tmp_path / "created").exists()


MECHANISM = 'import pathlib\npathlib.Path("created").touch()\n'


def test_a_catalogue_in_a_configuration_file_is_not_run(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "mechanism.py").write_text(MECHANISM)
    (tmp_path / "study.yaml").write_text("diagnosis: {catalogue: theirs}\n")
    done, shown = dry_run(
        tmp_path, "--configfile", "config/config.yaml", "study.yaml", "--", "diagnose"
    )
    assert done.returncode != 0
    assert "--config 'diagnosis={catalogue: \"theirs\"}'" in shown
    assert not (tmp_path / "created").exists()


def test_an_engine_s_command_is_not_run_until_it_is_allowed(tmp_path):
    """Refused with what to type; what is typed is remembered for this folder and this command."""
    study = write_study(tmp_path / "bounce", may_start=False)
    planned = [sys.executable, "-m", "snakemake", "-n", "-j1", "-s", ROOT / "workflow/Snakefile"]
    planned += ["--configfile", "bounce/config.yaml"]

    def status(*more, cwd=tmp_path):
        words = [str(word) for word in (*planned, *more, "--", "screening")]
        done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
        assert "Traceback" not in done.stderr
        return done.returncode, done.stdout + done.stderr

    code, shown = status()
    assert code != 0
    assert tells(shown, "engine.command", "calibration allow bounce/config.yaml", "--config")
    typed = re.search(r"--config '.*?}'", shown)
    flag = shlex.split(typed[0])
    assert status(*flag)[0] == 0
    assert status()[0] != 0  # the flag was for that one call
    done(sys.executable, "-m", "calibration.interface.cli", "allow", "bounce", cwd=tmp_path)
    assert status()[0] == 0
    shutil.copytree(study.parent, tmp_path / "elsewhere" / "bounce")
    assert status(cwd=tmp_path / "elsewhere")[0] != 0
    study.write_text(study.read_text().replace("{spec}", "{spec} more"))
    assert status()[0] != 0


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


def test_aliases_that_multiply_are_refused_in_a_sentence():
    """Nine levels of ten: a thousand million values from 300 bytes."""
    levels = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    levels += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    with pytest.raises(ConfigError) as error:
        data_of("\n".join(levels))
    assert "at most 100000 values" in str(error.value)
    assert len(str(error.value)) < 300


@pytest.mark.parametrize(
    "text", ["a: &a [*a]", "a: &a {b: *a}", "a: !!bool x", "a: !!int ''", "? [1]: 2"]
)
def test_what_yaml_stumbles_over_is_a_sentence(text):
    with pytest.raises(ConfigError) as error:
        data_of(text)
    assert len(str(error.value).splitlines()) == 1
