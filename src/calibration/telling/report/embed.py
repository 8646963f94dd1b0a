"""Files turned into pieces of a page that needs no other file: figures, tables, images and
downloads; and a page of Markdown as such a page."""

import base64
import re
import zlib
from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from calibration.engines.templates import macros
from calibration.figures import label
from calibration.files import write_text
from calibration.intake.tables import read_written
from calibration.runs.snakemake_command import WORKFLOW

CAPTIONS = WORKFLOW / "report"
SHOWN_ROWS = 60
NARROW = 3  # columns that a phone shows side by side
READABLE = 8.0  # px, of letters on a phone; a figure that is wider then moves sideways
CARDS = 12  # rows of a wider table that a phone shows as cards; a longer one moves sideways
LONG_NUMBER = re.compile(r"-?\d+\.\d{5,}(e[+-]?\d+)?")  # computed; printed ones keep their digits
ROUNDING = 1e-12  # what is smaller is the rounding error of a zero


def uri_of(content: bytes, kind: str) -> str:
    """Bytes as a data: address."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def download(path: Path) -> dict[str, str]:
    """A file for a download link: see `packed`."""
    return packed(f"{path.parent.name}_{path.name}", path.read_bytes())


def packed(name: str, content: bytes) -> dict[str, str]:
    """A download of the page: its name and its bytes, compressed, for the page to unpack."""
    return {"file": name, "packed": base64.b64encode(zlib.compress(content, 9)).decode()}


def downloads_of(*pieces: Any) -> dict[str, str]:
    """{name: packed bytes} of all downloads in the page's pieces: two links to a file share it."""
    found = {}
    for piece in pieces:
        if isinstance(piece, dict) and "packed" in piece:
            found[piece["file"]] = piece["packed"]
        elif isinstance(piece, (dict, list, tuple)):
            inner = piece.values() if isinstance(piece, dict) else piece
            found |= downloads_of(*inner)
    return found


def caption(name: str) -> str:
    """The sentence that says what to see in a figure, the same as in Snakemake's own report."""
    path = CAPTIONS / f"{name}.rst"
    return path.read_text().strip() if path.exists() else ""


def figure(path: Path, text: str, data: Sequence[Path] = ()) -> dict[str, Any]:
    """An SVG figure with its caption and downloads of the files that hold its numbers.

    A screen reader gets the first sentence of the caption as its title, and all of it as its
    description.
    """
    svg, width = _inline(path)
    svg = _said(svg, f"{path.parent.name}-{path.stem}", text)
    letters = [float(size) for size in re.findall(r"font(?:-size)?: ([\d.]+)px", svg)]
    return {
        "svg": svg,
        "caption": text,
        "wide": width > 480,
        "most": round(1.35 * width),
        "least": round(READABLE * width / min(letters)) if letters else 0,
        "downloads": [download(p) for p in data if p.exists()],
    }


def _inline(path):
    """An SVG file for use within a page: (its code, its width in points). Ground and ink follow the
    page."""
    svg = re.sub(r"^.*?(?=<svg)", "", path.read_text(), count=1, flags=re.S)
    svg = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", svg, flags=re.S)
    # ids are unique only within their own file
    prefix = f"{path.parent.name}-{path.stem}-"
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", svg)
    svg = svg.replace('style="fill: #ffffff"', 'style="fill: none"')
    svg = re.sub(r"(?<!fill: #ffffff; )stroke: #000000", "stroke: currentColor", svg)
    # coordinates to a hundredth of a point; the words between the tags keep their digits
    svg = re.sub(r"<[^>]+>", lambda tag: re.sub(r"(\.\d\d)\d+", r"\1", tag[0]), svg)
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg).group(1))
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", svg, count=1)
    return svg, width


def _said(svg, name, text):
    """An inline figure with a title and a description, which make it one image to a screen
    reader."""
    title = re.split(r"(?<=[.:]) ", text, maxsplit=1)[0].rstrip(".:") or name.replace("-", " ")
    words = f'<title id="{name}-title">{escape(title)}</title>'
    words += f'<desc id="{name}-desc">{escape(text)}</desc>'
    role = f'<svg role="img" aria-labelledby="{name}-title" aria-describedby="{name}-desc"'
    return re.sub(r"<svg([^>]*)>", lambda tag: f"{role}{tag[1]}>{words}", svg, count=1)


def table(
    path: Path,
    title: str,
    first: tuple[str, Any] | None = None,
    rows: int = SHOWN_ROWS,
    unshown: Sequence[str] = (),
) -> dict[str, Any]:
    """A CSV file as a table with its download.

    first: (column, value) of rows that come first; rows: the most that are shown; unshown: columns
    that are only in the download, as are the runs' names and the experiment where there is but one.
    """
    frame = read_written(path)
    if first and first[0] in frame:
        frame = frame.sort_values(first[0], key=lambda v: v != first[1], kind="stable")
    hidden = {"run_id", *unshown}
    if "experiment" in frame and frame["experiment"].nunique() == 1:
        hidden.add("experiment")
    shown = frame[[c for c in frame if c not in hidden]].head(rows)
    return {
        "title": title,
        "html": html_of(shown),
        "rows": len(frame),
        "shown": len(shown),
        "download": download(path),
    }


def html_of(frame: pd.DataFrame) -> str:
    """HTML of a table; numbers to four digits, headings without underscores. A cell has its heading
    with it, as a short and wide table is shown as cards on a phone."""
    names = [str(column).replace("_", " ") for column in frame]
    rows = [map(cell, row) for row in frame.itertuples(index=False, name=None)]
    return html_table(names, rows, cards=len(names) > NARROW and len(frame) <= CARDS)


def html_table(
    names: Sequence[str],
    rows: Iterable[Iterable[str]],
    cards: bool,
    words: Callable[[str], str] = escape,
) -> str:
    """HTML of rows of texts below their headings; words: what makes HTML of a text."""
    cells = [list(zip(names, row, strict=True)) for row in rows]
    text: str = macros(__package__, "pieces").table(names, cells, cards, words, escape)
    return text


def filled(template: str, **given: Any) -> str:
    """Text of a template of this package; what is given is escaped."""
    environment = Environment(
        loader=PackageLoader(__package__, "."), autoescape=True, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(template).render(**given)


def cell(value: Any) -> str:
    """Text of one table cell."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, float):
        if value != value:
            return ""
        value = 0.0 if abs(value) < ROUNDING else value
        return f"{value:.0f}" if value == int(value) and abs(value) < 1e6 else f"{value:.4g}"
    if LONG_NUMBER.fullmatch(str(value)):
        return cell(float(value))
    return label(str(value)) if re.fullmatch(r"[a-z0-9_]+", str(value)) else str(value)


FIGURE = re.compile(r"!\[(.*)\]\((.*\.svg)\)")


def write_page(title: str, markdown: str, folder: str | Path, out: str | Path) -> None:
    """Write the HTML of a page of Markdown that a stage wrote, which opens offline: headings,
    paragraphs, lists, tables, and figures that are SVG files in `folder`."""
    blocks = [block for block in re.split(r"\n\s*\n", markdown.strip()) if block]
    body = Markup("\n".join(_block(block, Path(folder)) for block in blocks))
    write_text(filled("plain.html.j2", title=title, body=body), out)


def _block(block, folder):
    lines = block.splitlines()
    if drawn := FIGURE.fullmatch(block.strip()):
        path = folder / drawn[2]
        if not path.is_file():
            return ""
        own = figure(path, caption(f"{folder.name}_{path.stem}") or f"{drawn[1]}.")
        return macros(__package__, "pieces").chart(own, escape)
    level = len(block) - len(block.lstrip("#"))
    if level:
        return f"<h{level}>{_words(block[level:].strip())}</h{level}>"
    if all(line.startswith("- ") for line in lines):
        return f"<ul>{''.join(f'<li>{_words(line[2:])}</li>' for line in lines)}</ul>"
    if all(line.startswith("|") for line in lines):
        head, _, *rows = ([c.strip() for c in line.strip("|").split("|")] for line in lines)
        return f'<div class="scroll">{html_table(head, rows, cards=True, words=_words)}</div>'
    return f"<p>{_words(' '.join(lines))}</p>"


def _words(text):
    """Text with its bold parts."""
    return re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", escape(text))
