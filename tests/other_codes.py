"""Other codes as engines, for tests that need their programs."""

import pytest

from calibration import engines
from calibration.errors import ConfigError


def entry_or_skip(name):
    """The entry of another code in a run spec; skips the test where it is not installed."""
    try:
        return engines.entry_of(name)
    except ConfigError as error:
        pytest.skip(str(error))
