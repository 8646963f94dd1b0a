"""A page of Markdown that a stage wrote, as one HTML file that opens offline: headings, paragraphs,
lists, tables and figures."""

import re
from html import escape
from pathlib import Path

from markupsafe import Markup

from calibration.engines.templates import macros
from calibration.files import write_text
from calibration.telling.report.embed import caption, figure, filled, html_table

FIGURE = re.compile(r"!\[(.*)\]\((.*\.svg)\)")


def write_page(title: str, markdown: str, folder: str | Path, out: str | Path) -> None:
    """Write the HTML of a page whose figures are SVG files in `folder`, atomically."""
    blocks = [block for block in re.split(r"\n\s*\n", markdown.strip()) if block]
    body = Markup("\n".join(_block(block, Path(folder)) for block in blocks))
    write_text(filled("plain.html.j2", title=title, body=body), out)


def _block(block, folder):
    lines = block.splitlines()
    drawn = FIGURE.fullmatch(block.strip())
    if drawn:
        return _figure(drawn[1], folder / drawn[2])
    level = len(block) - len(block.lstrip("#"))
    if level:
        return f"<h{level}>{_words(block[level:].strip())}</h{level}>"
    if all(line.startswith("- ") for line in lines):
        return f"<ul>{''.join(f'<li>{_words(line[2:])}</li>' for line in lines)}</ul>"
    if all(line.startswith("|") for line in lines):
        return _table([[c.strip() for c in line.strip("|").split("|")] for line in lines])
    return f"<p>{_words(' '.join(lines))}</p>"


def _figure(words, path):
    if not path.is_file():
        return ""
    drawn = figure(path, caption(f"{path.parent.name}_{path.stem}") or f"{words}.")
    return macros(__package__, "pieces").chart(drawn, escape)


def _table(rows):
    """Rows of cells, the second of which rules the head off."""
    table = html_table(rows[0], rows[2:], cards=True, words=_words)
    return f'<div class="scroll">{table}</div>'


def _words(text):
    """Text with its bold parts."""
    return re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", escape(text))
