"""Errors at the border: what was wrong, where, and what is allowed.

What comes from outside ends in a value or in one kind of error, `ConfigError`. A file's size and
kind are looked at before it is opened (`dem.tables.limits`). Libraries that decode what others
wrote (pictures, sound) raise errors of a dozen kinds for a damaged file: `decoding` makes one of
them. It stands about a library's call alone, never about our own code.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import DemError, InputError

if TYPE_CHECKING:
    from pydantic import ValidationError

MACHINE = {
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EFBIG, errno.EIO,
    errno.EMFILE, errno.ENOMEM,
}  # fmt: skip
"""What a machine refuses to any program: room, rights, memory."""


class CalibrationError(Exception):
    """What the calibration refuses; as `DemError`, it is shown to the user as one line."""


ConfigError = InputError
"""A configuration or data file that cannot be used; the message is made of what it names: `path`,
`line`, `column`, `key` (of a configuration, or an option), `value` and `allowed`."""

CONFIGURATION = "configuration"
"""What stands for the files of a configuration until `parse_config` has found the one."""


def at_key(key: str, reason: str, value: Any = None, allowed: Any = None) -> ConfigError:
    """The error of a dotted key of the configuration, whose file and line `parse_config` finds."""
    return ConfigError(reason, path=CONFIGURATION, key=key, value=value, allowed=allowed)


def first_fault(error: ValidationError, *above: str) -> dict[str, Any]:
    """{key, value, allowed}, for a ConfigError, of the first thing that a schema refuses; above:
    keys that lead to what was read."""
    first = error.errors()[0]
    return {
        "key": ".".join([*above, *map(str, first["loc"])]) or None,
        "value": first.get("input"),
        "allowed": first["msg"].removeprefix("Input should be "),
    }


REFUSALS = (CalibrationError, DemError, OSError)
"""What reading a study or a file of it raises; `in_words` tells each in one line."""


def of_the_machine(error: BaseException) -> bool:
    """Return whether an error is the machine's refusal and no fault of the program or its input."""
    return isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno in MACHINE)


def in_words(error: BaseException) -> str:
    """One line: our own errors as they say it, the machine's refusal, any other with its kind."""
    if isinstance(error, CalibrationError | DemError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"there is not enough memory. {error}".strip()
    if isinstance(error, OSError) and of_the_machine(error):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}"
    return f"{type(error).__name__}: {error}"


class RankDeficientError(CalibrationError):
    """A model whose terms cannot be told apart by the design."""

    def __init__(self, terms: Sequence[str]):
        self.terms = terms
        super().__init__(f"the design cannot tell these terms apart: {', '.join(terms)}")


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
