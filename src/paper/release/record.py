"""What is known of a release's data: which engine made each part of it, when, and how long it
took."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from dem.io.files import write_json

KEPT = Path("results/reference")
RECORD = KEPT / "release.json"


@dataclass(frozen=True)
class Made:
    """One part of the data.

    engine : fingerprint of the engine that made it
    date : of its end, year-month-day
    wall_time_s : what its commands took [s], in the call that ended it; None where nobody recorded
        it
    cores : that they were given
    """

    engine: str
    date: str
    wall_time_s: float | None = None
    cores: int | None = None


def read_record(path: str | Path = RECORD) -> dict[str, Made]:
    """{part: Made} of a record; empty where there is none."""
    if not Path(path).is_file():
        return {}
    return {name: Made(**made) for name, made in json.loads(Path(path).read_text()).items()}


def write_record(record: Mapping[str, Made], path: str | Path = RECORD) -> None:
    """Write {part: Made}."""
    write_json(Path(path), {name: asdict(made) for name, made in record.items()})


def due(names: Iterable[str], record: Mapping[str, Made], engine: str) -> list[str]:
    """Of these parts, those that another engine than this one made, or that nobody recorded."""
    return [name for name in names if name not in record or record[name].engine != engine]


def made(parts: Iterable[str], record: Mapping[str, Made]) -> str:
    """A sentence: which engine made these parts, and when; each further engine with its parts."""
    by_engine = {}  # type: ignore[var-annotated]
    for name in parts:
        if name in record:
            by_engine.setdefault(record[name].engine, []).append(name)
    sentences = []
    for engine, names in by_engine.items():
        dates = sorted({record[name].date for name in names})
        when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
        what = "The data" if len(by_engine) == 1 else ", ".join(f"`{n}`" for n in names)
        were = "were" if what == "The data" or len(names) > 1 else "was"
        sentences.append(f"{what} {were} made by engine `{engine}`, {when}.")
    return " ".join(sentences)
