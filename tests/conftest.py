"""Options of the whole test suite."""

import pytest


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
    recording = config.getoption("--record") or config.getoption("--record-peers")
    if recording and config.getoption("numprocesses", None):
        raise pytest.UsageError("records are gathered in one process: add -n 0")
