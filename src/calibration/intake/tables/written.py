"""Tables that this project wrote: commas, points, UTF-8, nothing to recognise."""

from pathlib import Path
from typing import Any

import pandas as pd

from calibration.errors import ConfigError


def read_written(path: str | Path, **options: Any) -> pd.DataFrame:
    """Data frame of a CSV file that a stage wrote; options go to pandas. Raises ConfigError where
    it is none."""
    try:
        return pd.read_csv(path, **options)
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    except ValueError as error:  # what pandas raises for an empty, ragged or binary file
        reason = f"is not the table that a stage wrote ({str(error).splitlines()[0]})"
        raise ConfigError(reason, path=path, allowed="delete it; it is then made again") from None
