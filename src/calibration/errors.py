"""Errors at the border: what was wrong, where, and what is allowed."""

import errno
from collections.abc import Sequence

from dem.errors import InputError

MACHINE = {
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EFBIG, errno.EIO,
    errno.EMFILE, errno.ENOMEM,
}  # fmt: skip
"""What a machine refuses to any program: room, rights, memory."""


class CalibrationError(Exception):
    """Base class of everything that is shown to the user as one line."""


class ConfigError(CalibrationError, InputError):
    """A configuration or data file that cannot be used."""


def of_the_machine(error: BaseException) -> bool:
    """Whether an error is the machine's refusal and no fault of the program or its input."""
    return isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno in MACHINE)


def in_words(error: BaseException) -> str:
    """The machine's refusal in one line; any other error as it says it, with its kind."""
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
