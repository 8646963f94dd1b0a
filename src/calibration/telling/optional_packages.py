"""This package by name and version, and those that a plain install leaves out."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata

from calibration.errors import CalibrationError

PACKAGE = "granular-calibration"


def program() -> str:
    """This package and its version, as a citation names it."""
    return f"{PACKAGE} {metadata.version(PACKAGE)}"


@contextmanager
def extra(name: str, purpose: str) -> Iterator[None]:
    """Import what an extra of this package brings. Raises CalibrationError that names the extra
    where it is not installed; purpose: what needs it, as a sentence begins."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise CalibrationError(
            f"{purpose} needs the package {error.name}, which a plain install leaves out: pip "
            f"install '{PACKAGE}[{name}]'"
        ) from None
