"""The methods' questions as a form, and what was filled in as a new study."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError
from calibration.runs.feasibility import check_ahead
from calibration.study.new.answers import Faults, Raw, read_entries, separate
from calibration.study.new.laboratory import Laboratory, laboratory_of, write_laboratory
from calibration.study.new.methods import methods

MOST_BYTES = 256 * 1024
"""Of a filled form."""
MOST_ENTRIES = 200


def form() -> list[dict[str, Any]]:
    """What the page needs of each method: its name, title, about, whether it may stand several
    times, and its questions."""
    return [
        {
            "name": m.name,
            "title": m.title,
            "about": m.about,
            "several": m.under,
            "questions": [_question(q) for q in m.columns],
        }
        for m in methods().values()
    ]


def _question(q):
    return {"key": q.key, "text": q.text, "allowed": q.allowed, "words": q.words,
            "reading": q.reading, "needed": q.needed, "example": q.example}  # fmt: skip


def build(body: bytes, here: Path) -> tuple[Laboratory, list[str]]:
    """(`Laboratory`, sentences) of a filled form, {name, tests: [{method, answers: {key: text}}]},
    written into a new folder in `here`. Raises CalibrationError, with nothing written."""
    name, tests = _parts(body)
    if not name or Path(name).name != name or name in (".", ".."):
        raise CalibrationError(f"name, {name}: cannot be a study's folder; allowed: a plain name")
    raws = [raw for test in tests if (raw := _raw(test))]
    if not raws:
        raise CalibrationError("no test is filled in; allowed: the grain, its size and a test")
    laboratory = laboratory_of(Path(name), read_entries(raws))
    if (here / name).exists():
        raise CalibrationError(f"name, {name}: exists already")
    return laboratory, write_laboratory(laboratory, check_ahead)


def _parts(body):
    """Name and tests of a form's JSON. Raises CalibrationError for another shape."""
    try:
        data = json.loads(body)
        name, tests = data["name"], data["tests"]
        shaped = isinstance(name, str) and len(tests) <= MOST_ENTRIES
        shaped = shaped and all(
            isinstance(t["method"], str) and all(isinstance(x, str) for x in t["answers"].values())
            for t in tests
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        shaped = False
    if not shaped:
        raise CalibrationError("this is no filled form; allowed: what the page sends")
    return name.strip(), tests


def _raw(test):
    """`Raw` of a test, None of one in which nothing stands."""
    given = {k: v for k, v in test["answers"].items() if v.strip()}
    if not given:
        return None
    method = methods().get(test["method"])
    if method is None:
        raise Faults([f"{test['method']}: is no test method; allowed: {', '.join(methods())}"])
    answers: dict[str, list[tuple[str, str]]] = {}
    for key, text in given.items():
        place = f"{method.title}, {key}"
        q = method.question(key)
        if q is None or not q.reading:
            answers[key] = [(text.strip(), place)]
        else:
            answers[key] = list(_lines(text, place))
    return Raw(method.name, answers, method.title)


def _lines(text: str, place: str) -> Iterator[tuple[str, str]]:
    """Readings of a text: a line each, or side by side as in options."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    for n, line in enumerate(lines, 1):
        where = f"{place}, line {n}" if len(lines) > 1 else place
        for word in separate(line):
            parts = word.split()
            numbers = len(parts) > 1 and all(p[:1].isdigit() for p in parts)
            yield from ((one, where) for one in (parts if numbers else [word]))
