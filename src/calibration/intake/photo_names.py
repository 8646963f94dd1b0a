"""Names of photographs, known without the libraries that read them."""

from collections.abc import Sequence
from pathlib import Path

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp")
FIT = ".fit.png"
"""Ending of the picture of a fit, which stands beside its photograph."""


def without_fits(paths: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """(photographs, sentences): pictures of fits, which a pattern such as *.png catches too, are
    left out and named."""
    kept = [p for p in paths if not p.name.endswith(FIT)]
    left = [p.name for p in paths if p.name.endswith(FIT)]
    return kept, ([f"left out, as pictures of a fit: {', '.join(left)}"] if left else [])
