"""Names of photographs, known without the libraries that read them."""

from collections.abc import Sequence
from pathlib import Path

from calibration.errors import CalibrationError, ConfigError
from dem.io.checked import digest_of

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp")
FIT = ".fit.png"
"""Ending of the picture of a fit, which stands beside its photograph."""


def refuse_twice(paths: Sequence[Path]) -> None:
    """Raise ConfigError for a photograph that is given twice, under another name too: it is no
    second reading."""
    seen: dict[str, Path] = {}
    for path in (p for p in paths if p.is_file()):  # what cannot be read is told by its reader
        first = seen.setdefault(digest_of(path), path)
        if first is not path:
            raise ConfigError(
                f"is the same photograph as {first}", path=path, allowed="each heap once"
            )


def without_fits(paths: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """(photographs, sentences): pictures of fits, which a pattern such as *.png catches too, are
    left out and named. Raises CalibrationError where nothing else is given."""
    kept = [p for p in paths if not p.name.endswith(FIT)]
    left = [p.name for p in paths if p.name.endswith(FIT)]
    said = f"left out, as pictures of a fit: {', '.join(left)}"
    if not kept:
        raise CalibrationError(f"{said}; allowed: the photographs beside them")
    return kept, [said] if left else []
