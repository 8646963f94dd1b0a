"""The methods' questions as options of `dem new`, and the options' words as answers."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from calibration.study.new.answers import Raw, words_of
from calibration.study.new.methods import Method, methods
from calibration.study.new.reading_tables import is_table, joined, raws_of_tables

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options by which a laboratory tells what it measured: a table, one for each question
    that has one by itself, and for each other method one that takes its readings and key=value."""
    parser.add_argument(
        "--from",
        type=Path,
        metavar="FILE",
        dest="filled",
        help="take what such a table tells, filled in (dem new --table)",
    )
    parser.add_argument("--sheet", help="of a workbook with several: the one that is meant")
    for method in methods().values():
        group = parser.add_argument_group(method.title, method.about)
        for q in (q for q in method.asked if q.option):
            shape: dict[str, Any] = {"nargs": "+", "metavar": "X"} if q.reading else {}
            example = f": {_one_word(q.example)}" if q.example else ""
            text = f"{q.text}{example}".replace("%", "%%")
            group.add_argument(f"--{q.option}", dest=_dest(q), help=text, **shape)
        if method.becomes or not method.own_options:
            group.add_argument(
                f"--{method.name}", nargs="+", action="append", default=[], metavar="X",
                dest=f"method_{method.name}", help=_words_help(method),
            )  # fmt: skip


def _dest(q):
    return q.option.replace("-", "_")


def _one_word(example):
    """An example as it is typed: a value and its unit are one word, a name stays as it is."""
    return example.replace(" ", "") if example[:1].isdigit() else example


def _words_help(method):
    first = method.readings[0]
    rest = [q for q in method.asked if q not in method.readings[:1]]
    if not method.becomes:
        columns = " x ".join(q.key for q in method.readings)
        numbers = "x".join(q.example.split()[0] for q in method.readings)
        unit = method.readings[-1].example.split()[-1]
        return f"{columns}, a word a grain: {numbers}{unit}"
    keys = "; ".join(f"{q.key}= {q.text}" for q in rest)
    return f"{first.text}: {_one_word(first.example)}; beside it {keys}".replace("%", "%%")


def raws_of(args: argparse.Namespace) -> list[Raw]:
    """[Raw] of all that the options tell. Raises CalibrationError for tables or photographs that
    cannot be read."""
    found = []
    for method in methods().values():
        several = getattr(args, f"method_{method.name}", ())
        place, sheet = f"option --{method.name}", args.sheet
        raws = [raw for words in several for raw in _told(method, words, place, sheet)]
        beside = [Raw(method.name, {}, place)]
        for q in (q for q in method.asked if q.option and getattr(args, _dest(q))):
            given, place = getattr(args, _dest(q)), f"option --{q.option}"
            own = Raw(method.name, {q.key: [(given, f"{place} {given}")]}, place)
            more = _told(method, given, place, sheet) if q.reading else [own]
            beside = [joined(raw, other) for raw in beside for other in more]
        if beside[0].answers:  # of the first, where there are several
            raws = [joined(a, b) for a in raws[:1] for b in beside] + raws[1:] or beside
        found += raws
    return found


def _told(method: Method, words: Sequence[str], place: str, sheet: str | None) -> list[Raw]:
    """[Raw] of an option's words: readings, key=value, tables, and photographs of heaps."""
    files = [word for word in words if is_table(word)]
    rest = [word for word in words if word not in files]
    if method.readings[0].unit == "angle_of_repose_deg":
        rest = _measured_photographs(rest)
    raw = words_of(method, rest, place)
    if not files:
        return [raw]
    raws, said = raws_of_tables(method, files, raw, sheet)
    print(*said, sep="\n", end="\n" if said else "")
    return raws


def _measured_photographs(words):
    """The words with the angles of photographs in place of their names; says what was left out,
    and what is not corrected."""
    paths = [Path(word) for word in words if Path(word).suffix.lower() in PICTURES]
    if not paths:
        return words
    from calibration.intake.photo.measure import read_photos, uncorrected  # brings image libraries

    photos, said = read_photos(paths)
    angles = [round(photo.angle_deg, 3) for photo in photos]
    print(*said, uncorrected(angles), sep="\n")
    return [word for word in words if Path(word) not in paths] + [f"{x:.6g}" for x in angles]
