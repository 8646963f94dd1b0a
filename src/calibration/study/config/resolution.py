"""A study that its `resolution` alone makes impossible: its fault is told with what can be done,
and not by a line of the file, which nobody has to change."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calibration.errors import ConfigError
from calibration.study.config.parse import parse_config
from calibration.study.config.schema import COARSER

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.study.config.schema import Config

FULL = "full"


def parse_resolved(
    data: Mapping[str, Any],
    files: Sequence[str | Path] = (),
    stages: Collection[str] | None = None,
) -> Config:
    """`parse_config`. Raises ConfigError of the resolution where a finer one makes a study of the
    same files, and as `parse_config` does elsewhere."""
    asked = str(data.get("resolution"))
    try:
        return parse_config(data, files=files, stages=stages)
    except ConfigError as error:
        # the coarsest first
        ways = [*sorted(COARSER, key=COARSER.__getitem__, reverse=True), FULL]
        finer = ways[ways.index(asked) + 1 :] if asked in COARSER else []
        good = [way for way in finer if _parses(dict(data) | {"resolution": way}, files, stages)]
        if not good:
            raise
        raise ConfigError(
            f"its grains are {COARSER[asked] ** (1 / 3):.3g} times as wide as the study's, and do "
            f"not fit: {_told(error)}",
            key="resolution",
            value=asked,
            allowed=f"{' or '.join(good)} ({FULL}: without --config resolution)",
        ) from None


def _parses(data, files, stages):
    try:
        parse_config(data, files=files, stages=stages)
    except ConfigError:
        return False
    return True


def _told(error):
    """What a fault says behind its file and line."""
    key = str(error.key or "").removeprefix("run.")
    value = f" {error.value}" if error.value is not None else ""
    needed = f", where it has to be {error.allowed}" if error.allowed else ""
    return f"{key}{value}{needed}" if key else str(error)
