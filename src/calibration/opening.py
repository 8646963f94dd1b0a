"""What a study says before any run: what was read, and what is valid but risky."""

from calibration.config import point_spec, read_back
from calibration.factors import read_factors
from dem.spec import parse_spec


def opening(config):
    """Sentences: the measured values of each target as they were read, then the engine's warnings.

    Raises ConfigError for a table that cannot be read.
    """
    found = [f"read {text}" for text in read_back(config)]
    return found + [f"warning: {text}" for text in _warnings(config)]


def _warnings(config):
    """The engine's warnings of a run with every factor at its fixed level, else at its middle."""
    from dem.advice import warnings_of  # loads the engine

    factors = read_factors(config.factors)
    levels = {f.key: config.fixed.get(f.name, f.centre) for f in factors}
    return warnings_of(parse_spec(point_spec(config.run, config.experiment, levels, config.seed)))
