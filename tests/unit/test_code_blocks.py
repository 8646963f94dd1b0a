"""Every code block of the documentation holds: Python runs, YAML passes the tool's own schema, and
shell commands exist with the options and files that are named.

Pages with a test of their own that executes their blocks are in `EXECUTED`; the generic checks of
YAML and shell hold for them as well.
"""

import ast
import contextlib
import io
import os
import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml
from snakemake.cli import get_argument_parser

from calibration.engines import liggghts
from calibration.intake.measurements import read_measured
from calibration.interface.commands import main as dem
from calibration.runs.snakemake_command import rule_names
from calibration.study.config import Config, overlay, parse_config
from dem.spec import RunSpec, parse_spec
from dem.units import in_ascii, unit_of, without_unit
from facts import ROOT
from started import python

PAGES = (
    "README.md", "config/*.md", "data/*/README.md", "docs/*.md", "examples/*/README.md",
    "examples/*.md",
)  # fmt: skip
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.M | re.S)
EXECUTED = {"README.md", "docs/atlas.md", "docs/tutorial.md", "docs/extend.md"}
"""Pages whose blocks the tests of notebook, atlas, tutorial and how-tos execute."""

OWN_EXPERIMENTS = {"throw"}  # that docs/extend.md adds
MADE = (
    "peas/",
    "wheat",
    "my_",
    "heap",
    "throw",
    "small",
    "wrong",
    "quick.yaml",
    "five.yaml",
    "results/",
)
"""Beginnings of the names of files that a page's reader makes."""

SHELL = {"cat", "cd", "export", "grep", "head", "pip", "pytest", "python", "python3", "rm", "sed"}
"""Commands of any shell or of any Python, which are not checked."""


def pages():
    return sorted({p for pattern in PAGES for p in ROOT.glob(pattern)})


def blocks(*languages):
    """Parameters (page, text) of all blocks in these languages."""
    return [
        pytest.param(name, text, id=f"{name}:{whole[: m.start()].count(chr(10)) + 1}")
        for page in pages()
        for name, whole in [(page.relative_to(ROOT).as_posix(), page.read_text("utf-8"))]
        for m in FENCE.finditer(whole)
        for text in [m[2]]
        if m[1] in languages
    ]


@pytest.mark.parametrize(("page", "text"), blocks("python"))
def test_python_runs(page, text, tmp_path):
    if page in EXECUTED:
        ast.parse(text)
        return
    python(tmp_path, "-W", "error", "-c", text)


def as_the_reader_has_it(folder, data):
    """The folder with the project's files and the tables and programs that the block names."""
    for name in ("config", "data", "examples"):
        (folder / name).symlink_to(ROOT / name)
    metric = data.get("calibrate", {}).get("to", "angle_of_repose_deg")
    rows = [f"heap,{without_unit(metric)},{v},{in_ascii(unit_of(metric) or '')}," for v in (25, 26)]
    head = "experiment,quantity,value,unit,drop_height_mm"
    (folder / "measured.csv").write_text("\n".join([head, *rows]) + "\n")
    engine = data.get("engine")
    for name in engine.get("files", []) if isinstance(engine, dict) else []:
        (folder / name).write_text("")
    return folder


@pytest.fixture
def programs_on_the_path(tmp_path, monkeypatch):
    """A stand-in for the program that a block names, where it is not installed: the schema is asked
    for, no run. A process asks for a version once, so that the stand-in's is forgotten."""
    if shutil.which("liggghts"):
        yield
        return
    program = tmp_path / "liggghts"
    program.write_text("#!/bin/sh\necho Version LIGGGHTS-PUBLIC 3.8.0\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    yield
    liggghts.version.cache_clear()


@pytest.mark.parametrize(("page", "text"), blocks("yaml"))
def test_yaml_passes_the_schema_of_what_it_is(
    page, text, tmp_path, monkeypatch, programs_on_the_path
):
    data = yaml.safe_load(text)
    monkeypatch.chdir(as_the_reader_has_it(tmp_path, data))
    if {"materials", "contacts"} <= set(data):
        assert set(data) <= set(RunSpec.model_fields)
        parse_spec(data)
    else:
        assert set(data) <= set(Config.model_fields), "keys of neither a run spec nor a study"
        salt = yaml.safe_load((ROOT / "config/config.yaml").read_text())
        if "to" in data.get("calibrate", {}):  # the reader's own readings in place of the salt's
            salt["measurements"] = "measured.csv"
        parse_config(overlay(salt, data))


@pytest.mark.parametrize(("page", "text"), blocks("csv"))
def test_a_table_is_read_as_measurements(page, text, tmp_path):
    (tmp_path / "measured.csv").write_text(text)
    [measured] = read_measured(tmp_path / "measured.csv").conditions
    assert measured.n == len(text.splitlines()) - 1


def commands(text):
    """The commands of a shell block as lists of words; what is written into files is left out."""
    text = re.sub(r"<<'EOF'\n.*?\nEOF\n", "\n", text, flags=re.S).replace("\\\n", " ")
    for line in text.splitlines():
        for part in re.split(r"&&|\|\||\|", line):
            words = shlex.split(part, comments=True)
            cut = next((k for k, w in enumerate(words) if w.startswith(">")), len(words))
            if words:
                yield words[:cut]


@pytest.mark.parametrize(("page", "text"), blocks("bash"))
def test_commands_exist_with_these_options(page, text):
    for words in commands(text):
        program = Path(words[0]).name
        if program in CHECKS:
            CHECKS[program](words[1:])
        else:
            assert program in SHELL | {"true"}, f"{page}: {program} is checked by nothing"


def exists(name):
    assert name.startswith(MADE) or (ROOT / name).exists(), f"{name} does not exist"


def snakemake(words):
    """All options are snakemake's, the targets are stages or files, the files are there."""
    targets = rule_names()
    args = get_argument_parser([]).parse_args(words)
    for name in args.targets:
        assert name in targets, f"{name} is no stage"
    for path in [*(args.configfile or []), *(args.profile or [])]:
        exists(str(path))
    for setting in args.config or []:
        assert setting.split("=")[0] in Config.model_fields, setting


def dem_command(words):
    """The subcommand's help lists every option; what is named is there."""
    assert help_of(words[0]), f"dem {words[0]} does not exist"
    listed = set(re.findall(r"--?[a-z][\w-]*", help_of(words[0])))
    for k, word in enumerate(words[1:], 1):
        if word.startswith("--"):
            assert word in listed, f"dem {words[0]} has no {word}"
        elif words[k - 1] == "--experiment":
            assert word in re.findall(r"\w+", help_of("init")) or word in OWN_EXPERIMENTS
        elif words[0] in ("run", "check") and k == 1:
            exists(word)


def help_of(name):
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(io.StringIO()):
        with contextlib.suppress(SystemExit):
            dem([name, "--help"])
    return stream.getvalue()


def calibration(words):
    from calibration.interface.cli import _parser

    _parser().parse_args(words)


CHECKS = {"snakemake": snakemake, "dem": dem_command, "calibration": calibration}
"""Program -> check of the words after it."""
