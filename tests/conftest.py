"""Options of the whole test suite."""


def pytest_addoption(parser):
    parser.addoption(
        "--record",
        action="store_true",
        help="write docs/verification.json from the verification tests",
    )
    parser.addoption(
        "--record-peers",
        action="store_true",
        help="run the other engines on every case and write their results beside their inputs (half an hour)",
    )
