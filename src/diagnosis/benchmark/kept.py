"""Diagnoses that are kept one by one, so that a list of them goes on where it was cut off."""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from diagnosis.benchmark.study import wilson


def append(path: Path, row: Mapping[str, Any]) -> None:
    """Add a row (a mapping) to a CSV table, which begins with its keys."""
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, list(row))
        if not file.tell():
            writer.writeheader()
        writer.writerow(row)


def share(hits: Iterable[Any]) -> str:
    """How many of (n,) hits are true, in words, with the 95 % Wilson interval of the share."""
    hits = [bool(h) for h in hits]
    if not hits:
        return "not run"
    low, high = wilson(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} ({low:.0%} to {high:.0%})"


def between(page: str, begin: str, end: str) -> str:
    """The part of a page's text that stands between two marks."""
    return page.split(begin)[1].split(end)[0]
