"""The paper's factors as the rows of its tables have them."""

from calibration.figures import label


def said(name: str) -> str:
    """A factor's name in words, as it stands behind "effect of": "rolling friction, salt on
    steel"."""
    words = label(name)
    return words.replace(" of ", ", ", 1) if " on " in words else words
