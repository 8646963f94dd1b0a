"""Writes the pages from the kept results: docs/results.md, the README's rows and what it says of
them, and the tables of docs/evidence.md and docs/other-codes.md. The templates beside this file
have the words and read what is kept; `values` has what must be computed."""

import re
import textwrap
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
import yaml

from calibration.chain.study import Results
from calibration.figures import label, response_of
from calibration.files import read_json, write_text
from calibration.intake.tables import read_written
from calibration.statistics.equivalence import judged
from calibration.statistics.numbers import fixed, spread
from calibration.study.stage import load_stages
from calibration.telling.export import decks as trials
from calibration.telling.sentences import sentences_of
from paper import rigs
from paper.audit import run_audit
from paper.release import values
from paper.reproduction.table import counts

KEPT, FUNNELS = Path("results/reference"), "funnels.csv"
RECORD = KEPT / "release.json"
"""{part of a release: the engine that made it, the date of its end, what its commands took in the
call that ended it [s; null where nobody recorded it] and the cores that they had}."""
README, PAGE = Path("README.md"), Path("docs/results.md")
EVIDENCE, CODES = Path("docs/evidence.md"), Path("docs/other-codes.md")
PIECES = {
    "readme_table": (README, "results"),
    "readme": (README, "said"),
    "comparison": (EVIDENCE, "ways"),
    "bulk_processes": (EVIDENCE, "bulk"),
    "code_studies": (EVIDENCE, "codes"),
    "deck_trials": (CODES, "trials"),
    "soybean": (Path("examples/soybean/README.md"), "found"),
}
"""{template: (page, name of the marks between which it stands)}."""
NUMBERS = ("none", "one", "two", "three", "four", "five", "six", "seven")
WIDTH = 100
ASIS = r"#|\||<!--|```|!\[|`salt|All rows|\s*$"
PROSE = re.compile(rf"^```[\s\S]*?^```.*|^(?!{ASIS}).+(?:\n(?!{ASIS}|- ).+)*", re.M)
"""A block of code; a paragraph or an item."""


def read_record(path: str | Path = RECORD) -> dict[str, Any]:
    """The content of a record; empty where there is none."""
    return read_json(path) if Path(path).is_file() else {}


def made(parts: Iterable[str], record: Mapping[str, Any]) -> str:
    """A sentence: which engine made these parts, and when; each further engine with its parts."""
    by_engine: dict[str, dict[str, str]] = {}
    for name in parts:
        if name in record:
            by_engine.setdefault(record[name]["engine"], {})[name] = record[name]["date"]
    return values.said("made", by_engine)


def listed(items: Iterable[str]) -> str:
    """'A', 'A and B', 'A, B and C'."""
    items = list(items)
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)


def counted(number: int) -> str:
    """A number up to seven in a word."""
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def filled(template: str, kept: str | Path) -> str:
    """Text of a template, from the folder of kept results, wrapped."""
    kept = Path(kept)
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, autoescape=False,
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
    )  # fmt: skip
    environment.filters |= {
        "num": fixed,
        "signed": partial(fixed, sign="+"),
        "spread": spread,
        "known": pd.notna,
        "sig": lambda value, digits: f"{value:.{digits}g}",
        "minus": lambda text: text.replace("-", "−"),
        "degrees": lambda value, digits=1: f"{value:+.{digits}f}°".replace("-", "−"),
        "label": label,
        "listed": listed,
        "counted": counted,
    }
    environment.globals |= {
        "kept": kept,
        "values": values,
        "json": lambda path: read_json(kept / path),
        "history": read_written(KEPT / "speed" / "history.csv").to_dict("records"),
        "table": lambda path, key: read_written(kept / path).set_index(key),
        "there": lambda path: (kept / path).exists(),
        "config": lambda path: yaml.safe_load(Path(path).read_text("utf-8")),
        "printed": lambda name: read_written(f"data/paper/{name}.csv", comment="#"),
        "made": lambda *parts: made(parts, read_record(kept / "release.json")),
        "judged": lambda found: judged(found, "°"),
        "audited": lambda: len(run_audit("data/paper")),
        "reproduction": read_written(
            kept / "salt" / "reproduction" / "reproduction.csv", dtype={"paper": str}
        ).set_index("id"),
        "counts": counts,
        "response_of": response_of,
        "rigs": rigs,
        "trials": trials,
        "stages": load_stages,
        "results": Results,
        "sentences_of": sentences_of,
    }
    return wrapped(environment.get_template(f"{template}.md.j2").render())


def pieces() -> dict[tuple[Path, str, str], str]:
    """{(page, begin, end): text between these marks} of the pages that only a part of is
    written."""
    return {
        (page, f"<!-- {mark}: begin -->", f"<!-- {mark}: end -->"): filled(piece, KEPT).strip()
        for piece, (page, mark) in PIECES.items()
    }


def wrapped(text: str) -> str:
    """Paragraphs and items of a Markdown text filled to WIDTH columns anew; headings, tables, code
    and marks stay as they are."""
    return PROSE.sub(_refilled, text)


def _refilled(found):
    lines = found[0].split("\n")
    if lines[0].startswith("```"):
        return found[0]
    return textwrap.fill(
        " ".join(line.strip() for line in lines), WIDTH, break_long_words=False,
        break_on_hyphens=False, subsequent_indent="  " if lines[0].startswith("- ") else "",
    )  # fmt: skip


def write_pages() -> None:
    """Write every page that shows a release's data."""
    write_text(filled("results", KEPT), PAGE)
    for (page, begin, end), text in pieces().items():
        before, rest = page.read_text().split(begin)
        write_text(f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}", page)
