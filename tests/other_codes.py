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


FOUND = {
    "law": "constant_torque", "unit": "deg", "path": "elastic_plastic", "rolling_friction": 0.9,
    "static_friction": 0.67, "stiffness_factor": 2.25, "damping_ratio": 0.3, "reached": True,
    "with_the_same_number": 31.0, "runs": 46, "without_value": 0,
    "ranges": {"elastic_plastic": [25.0, 52.0], "no_rotation": [27.0, 61.0]},
}  # fmt: skip
"""What a search for other codes' numbers has found."""
