"""Errors that a user of the engine can meet; each says what was wrong, where, and what is
allowed."""

from pathlib import Path
from typing import Any

from dem.io.files import rows_of


class DemError(Exception):
    """Base class: anything the command line shows as one line without a traceback."""


class SpecError(DemError):
    """A run spec that cannot be run: dotted key, value, what is allowed, and the file where
    known."""

    def __init__(
        self, key: str, value: object, allowed: str, file: str | Path | None = None
    ) -> None:
        self.key, self.value, self.allowed, self.file = key, value, allowed, file
        where = f"{file}: " if file else ""
        super().__init__(f"{where}{key} = {value!r:.200}; allowed: {allowed}")


class InputError(DemError):
    """A file that a user gives and that cannot be used: where, what is wrong, what is allowed."""

    def __init__(
        self,
        reason: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        column: str | int | None = None,
        key: str | None = None,
        value: object = None,
        allowed: str | None = None,
    ) -> None:
        self.path, self.line, self.column, self.key = path, line, column, key
        self.reason, self.value, self.allowed = reason, value, allowed
        parts = str(path or ""), line and f"line {line}", column and f"column {column}"
        where = ", ".join(part for part in parts if part)
        said = reason if value is None else f"{reason} (got {value!r:.200})"
        text = ": ".join(part for part in (where, key, said) if part)
        super().__init__(f"{text}; allowed: {allowed}" if allowed else text)


_REFUSALS = {row["key"]: row for row in rows_of(Path(__file__).with_name("refusals.csv"))}


def refused(key: str, **facts: Any) -> InputError:
    """`InputError` of a fault of refusals.csv, whose texts name some of the facts; path, line,
    column and value are those of the error."""
    told, where = _REFUSALS[key], ("path", "line", "column", "value")
    reason, allowed = (told[text].format(**facts) for text in ("reason", "allowed"))
    return InputError(reason, allowed=allowed or None, **{k: facts.get(k) for k in where})


class MeshError(InputError):
    """A triangle mesh that cannot be used as a wall."""

    @property
    def file(self) -> str | Path | None:
        """The mesh's file."""
        return self.path


class ResultError(DemError):
    """A run's result that is missing or cannot be trusted; `missing` where there is none at all."""

    def __init__(self, file: str | Path, reason: str, missing: bool = False) -> None:
        self.file, self.reason, self.missing = file, reason, missing
        super().__init__(f"{file}: {reason}")


class StoppedError(DemError):
    """A run that was asked to end before it was finished."""


class BusyError(DemError):
    """A run that another process is making."""


class MeasureError(DemError):
    """A result that cannot be measured, such as the angle of a heap that did not form."""


class RefusedStateError(MeasureError):
    """A heap that stands but tells nothing: most of it is not where it should be.

    kind: `clogged` (grains stay in the funnel), `restless` (the closed funnel was never opened) or
    `uncovered` (the plate is not covered).
    """

    def __init__(self, kind: str, message: str) -> None:
        self.kind = kind
        super().__init__(message)


class LightBodyError(DemError):
    """A wall body that is free to move and so light that its contacts throw it: no time step of the
    grains is short enough for it."""


class BlowUpError(DemError):
    """A run that became unphysical."""

    def __init__(self, *, particle: int, time: float, reason: str, hint: str) -> None:
        self.particle, self.time = particle, time
        super().__init__(f"particle {particle} at {time:.6g} s: {reason}; likely cause: {hint}")


PHYSICAL = (BlowUpError, MeasureError)
"""Failures that the same spec would meet again on any machine; all others may pass."""
