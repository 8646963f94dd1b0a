"""What a refusal or a page says, pinned as facts: places, values, units and names, no wording."""

import re
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
"""Of the repository."""


def tells(text, *names):
    """Whether one sentence of a text, or one row of a table in it, holds all of these names."""
    whole = [*text.splitlines(), " ".join(text.split())]
    parts = [part for piece in whole for part in re.split(r"(?<=[.?!])\s+", piece)]
    return any(all(holds(part, name) for name in names) for part in parts)


def rows_in(text):
    """{first cell: the other cells} of every row of the tables of a page in Markdown."""
    rows = [
        line.strip().strip("|").split("|") for line in text.splitlines() if line.strip()[:1] == "|"
    ]
    return {first.strip(): [cell.strip() for cell in others] for first, *others in rows}


def fact(error, name):
    """An attribute of an error; a path or a file is its name without the folders."""
    found = getattr(error, name)
    return Path(found).name if name in ("path", "file") and found else found


def holds(text, name):
    """Whether a text holds a name or number whole: 1 is not in 10, nor rim in trim."""
    return re.search(rf"(?<!\w)(?<!\d\.){re.escape(name)}(?![\w]|\.\d)", text) is not None


@contextmanager
def refused(kind, /, *names, **facts):
    """A block that raises `kind` with the attributes in `facts`, whose text holds each of `names`.

    names: numbers, columns, files and allowed values that a reader needs, each a word or two.
    """
    with pytest.raises(kind) as caught:
        yield caught
    assert {name: fact(caught.value, name) for name in facts} == facts
    missing = [name for name in names if not holds(str(caught.value), name)]
    assert not missing, caught.value
