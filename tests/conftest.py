"""Options of the whole test suite."""

import fcntl
import os
import tempfile
from pathlib import Path

import pytest

from browser import browse, find_browser
from recording import Recorder

# one thread of linear algebra a process, as snakemake gives a job: pytest has a process a core, and
# two threads in each spend a third of the processor's time on waiting for one another
for library in ("OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
# the tests start the project some hundred times, and without its compiled Python each takes twice
# as long
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


DOUBLE = "double"


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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """A test in double precision is slow: the engine is compiled for it once more. The workflow's
    files, which take longest, come first, so that no process ends alone with one."""
    items.sort(key=lambda item: "tests/workflow/" not in item.nodeid)
    for item in items:
        if hasattr(item, "callspec") and DOUBLE in item.callspec.params.values():
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish(session):
    """Compile the engine once for all processes of a run with the verification: each begins with
    another precision and waits for what the others have begun."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if not worker or not any("tests/verification/" in item.nodeid for item in session.items):
        return
    from dem.precompile import compile_engine

    slow = any(item.get_closest_marker("slow") for item in session.items)
    precisions = ["mixed", DOUBLE] if slow else ["mixed"]
    first = int(worker.removeprefix("gw")) % 2
    for precision in precisions[:: -1 if first else 1]:
        with open(Path(tempfile.gettempdir(), f"compile-{precision}.lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            compile_engine(precision)


@pytest.fixture(autouse=True, scope="session")
def _own_settings(tmp_path_factory):
    """The user's folder of settings: no test reads what the user has allowed, nor allows more."""
    before = os.environ.get("XDG_CONFIG_HOME")
    os.environ["XDG_CONFIG_HOME"] = str(tmp_path_factory.mktemp("settings"))
    yield
    os.environ.pop("XDG_CONFIG_HOME")
    if before is not None:
        os.environ["XDG_CONFIG_HOME"] = before


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def with_data(here, request):
    """A folder to work in that has the project's config, data and examples."""
    for name in ("config", "data", "examples"):
        (here / name).symlink_to(request.config.rootpath / name)
    return here


@pytest.fixture
def repository(monkeypatch, request):
    """The project's own folder to work in."""
    monkeypatch.chdir(request.config.rootpath)
    return request.config.rootpath


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    """A tab of a browser; skips the test where there is none."""
    if find_browser() is None:
        pytest.skip("no Chromium on this machine: the page's look is not checked")
    with browse(find_browser(), tmp_path_factory.mktemp("browser")) as page:
        yield page
