"""What was read, said back."""

import numpy as np
from numpy.typing import ArrayLike


def summary(values: ArrayLike, unit: str = "", how: str = "") -> str:
    """One line: `10 values, 26.1° to 28.4°, mean 27.40° ± 0.8° (sd)`, and how the table was
    recognised. One value is said once."""
    values = np.asarray(values, float)
    if len(values) == 1:
        return f"1 value, {values[0]:.4g}{unit}" + (f" ({how})" if how else "")
    digits = _digits(values)
    low, high, mean = (
        f"{values.min():.4g}{unit}",
        f"{values.max():.4g}{unit}",
        f"{values.mean():.{digits}f}{unit}",
    )
    spread = f" ± {values.std(ddof=1):.2g}{unit}"
    text = f"{len(values)} values, {low} to {high}, mean {mean}{spread}"
    return f"{text} ({how})" if how else text


def _digits(values):
    """Decimals that four digits of the largest value take."""
    largest = float(np.abs(values).max())
    return int(np.clip(3 - np.floor(np.log10(largest)), 0, 6)) if largest > 0 else 1
