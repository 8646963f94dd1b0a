"""Options of the whole test suite."""

import os

import pytest

from recording import Recorder

# one thread of linear algebra a process, as snakemake gives a job: pytest has a process a core, and
# two threads in each spend a third of the processor's time on waiting for one another
for library in ("OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
# the tests start the project some hundred times, and without its compiled Python each takes twice
# as long
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_addoption(parser):
    parser.addoption(
        "--record",
        action="store_true",
        help="write docs/verification.json from the verification tests",
    )
    parser.addoption(
        "--record-peers",
        action="store_true",
        help="run the other engines on every case and write their results beside their inputs "
        "(half an hour)",
    )


def pytest_configure(config):
    if config.getoption("--record-peers") and config.getoption("numprocesses", None):
        raise pytest.UsageError("the peers' results are gathered in one process: add -n 0")
    if config.getoption("--record"):
        config.pluginmanager.register(Recorder(config))


@pytest.fixture(autouse=True, scope="session")
def _own_settings(tmp_path_factory):
    """The user's folder of settings: no test reads what the user has allowed, nor allows more."""
    before = os.environ.get("XDG_CONFIG_HOME")
    os.environ["XDG_CONFIG_HOME"] = str(tmp_path_factory.mktemp("settings"))
    yield
    os.environ.pop("XDG_CONFIG_HOME")
    if before is not None:
        os.environ["XDG_CONFIG_HOME"] = before
