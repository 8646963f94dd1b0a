"""A recording of the verification gathers what every process measured, and goes on where it was cut
off."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
CONFTEST = """
from pathlib import Path
from recording import Recorder

def pytest_configure(config):
    config.pluginmanager.register(Recorder(config, Path(__file__).parent))
"""
TESTED = """
import os
import pytest
from recording import FIGURE, RECORD, name_of

@pytest.mark.parametrize("number", range(4))
def test_measures(request, number):
    with open("ran", "a") as stream:
        stream.write(f"{number} ")
    values = {"test": name_of(request.node.nodeid), "value": number}
    request.node.user_properties.append((RECORD, values))
    request.node.user_properties.append((FIGURE, (f"figure_{number}", "<svg/>")))
    assert number != int(os.environ["FAILING"])
    if number == int(os.environ["SKIPPED"]):
        pytest.skip("a program is not here")
"""
GONE = {"test": "test_measured.py::test_gone", "value": 9}
OTHER = {"test": "test_other.py::test_kept", "value": 8}


@pytest.fixture
def project(tmp_path):
    """A folder of tests with records of a test that is gone and of a file that is not looked at."""
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "test_measured.py").write_text(TESTED)
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "verification.json").write_text(json.dumps([GONE, OTHER]))
    return tmp_path


def _record(project, processes, failing=-1, skipped=-1):
    (project / "ran").write_text("")
    environment = os.environ | {"FAILING": str(failing), "SKIPPED": str(skipped)}
    environment["PYTHONPATH"] = os.pathsep.join([str(TESTS), *sys.path])
    command = [sys.executable, "-m", "pytest", "-q", "-n", str(processes), "-p", "no:cacheprovider"]
    done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
    records = json.loads((project / "docs" / "verification.json").read_text())
    ran = sorted(map(int, (project / "ran").read_text().split()))
    return done.returncode, [record["value"] for record in records], ran


@pytest.mark.parametrize("processes", [0, 2])
def test_a_recording_that_failed_goes_on_with_what_is_left(project, processes):
    assert _record(project, processes, failing=2) == (1, [9, 8], [0, 1, 2, 3])
    assert _record(project, processes) == (0, [8, 0, 1, 2, 3], [2])
    drawn = {path.stem for path in (project / "docs" / "verification").iterdir()}
    assert drawn == {f"figure_{number}" for number in range(4)}
    assert _record(project, processes)[2] == [0, 1, 2, 3]  # a new one begins anew


def test_a_test_that_is_skipped_keeps_what_it_recorded(project):
    assert _record(project, 0)[1] == [8, 0, 1, 2, 3]
    assert _record(project, 0, skipped=1)[1] == [8, 0, 1, 2, 3]


def test_a_file_that_was_edited_is_recorded_anew(project):
    assert _record(project, 0, failing=2)[0] == 1
    (project / "test_measured.py").write_text(TESTED.replace('"value": number', '"value": 7'))
    assert _record(project, 0) == (0, [8, 7, 7, 7, 7], [0, 1, 2, 3])
