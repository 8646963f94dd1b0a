"""Options of the whole test suite."""


def pytest_addoption(parser):
    parser.addoption(
        "--record",
        action="store_true",
        help="write docs/verification.json from the verification tests",
    )
