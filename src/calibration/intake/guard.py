"""What comes from outside ends in a value or in one kind of error, `ConfigError`: file, place,
value and what is allowed.

A file's size and kind are looked at before it is opened (`dem.tables.limits`). Libraries that
decode what others wrote (pictures, sound) raise errors of a dozen kinds for a damaged file:
`decoding` makes one of them. It stands about a library's call alone, never about our own code.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from calibration.errors import CalibrationError, ConfigError
from dem.errors import InputError


@contextmanager
def in_study() -> Iterator[None]:
    """An InputError of the engine's readers becomes a ConfigError."""
    try:
        yield
    except ConfigError:
        raise
    except InputError as error:
        raise ConfigError(**vars(error)) from None


@contextmanager
def decoding(path: str | Path, what: str) -> Iterator[None]:
    """Whatever a library raises for a damaged file becomes a ConfigError: the file, what was wrong,
    and `what` is allowed."""
    try:
        yield
    except (CalibrationError, InputError):
        raise
    except Exception as error:
        said = (str(error).splitlines() or [""])[0][:200] or type(error).__name__
        where = f" ({said})" if str(path) not in said else ""
        reason = f"cannot be read, or is damaged{where}"
        if isinstance(error, OSError) and error.strerror:  # rights, a broken disk
            reason = f"cannot be read ({error.strerror})"
        raise ConfigError(reason, path=path, allowed=what) from None
