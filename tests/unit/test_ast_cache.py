"""What was read out of sources and is kept between starts: the same answers, and none of an older
code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from calibration import digests
from dem import fingerprint

MODULE = """
from pathlib import Path
from dem.ast_cache import Readings

def length(text):
    with Path("asked").open("a") as log:
        log.write(text)
    return FACTOR * len(text)

kept = Readings(length)
"""


@pytest.fixture
def start(tmp_path):
    """A function that asks for a text's reading in a Python of its own, and says what it computed
    and what it answered."""
    (tmp_path / "module.py").write_text("FACTOR = 1\n" + MODULE)

    def ask(text, **variables):
        (tmp_path / "asked").write_text("")
        source = Path(digests.SOURCES)
        environment = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{source}"} | variables
        if "PYTHONDONTWRITEBYTECODE" not in variables:
            environment.pop("PYTHONDONTWRITEBYTECODE", None)
        code = f"import module; print(module.kept({text!r}))"
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True, text=True, cwd=tmp_path, env=environment, check=True,
        )  # fmt: skip
        return (tmp_path / "asked").read_text(), int(done.stdout)

    return ask


def _kept(folder):
    return sorted((folder / "__pycache__").glob("*.json.gz"))


def test_a_second_start_reads_nothing_again(start):
    assert start("abc") == ("abc", 3)
    assert start("abc") == ("", 3)
    assert start("abcd") == ("abcd", 4)
    assert start("abc") == ("", 3)


def test_an_edited_module_begins_anew_and_leaves_one_file(start, tmp_path):
    start("abc")
    (tmp_path / "module.py").write_text("FACTOR = 10\n" + MODULE)
    assert start("abc") == ("abc", 30)
    assert len(_kept(tmp_path)) == 1


def test_the_engines_name_is_that_of_its_sources_read_anew():
    for path in fingerprint.engine_sources():
        text = path.read_text("utf-8")
        assert fingerprint.kept_code(text) == fingerprint.code_of(path.read_bytes())
