"""The audit as files: CSV for machines, Markdown and HTML for readers."""

import html
from collections.abc import Callable, Iterable
from pathlib import Path

import pandas as pd

from calibration.files import write_text

HEAD = {
    "id": "claim",
    "where": "where",
    "claim": "statement",
    "printed": "printed",
    "recomputed": "recomputed",
    "unit": "unit",
    "verdict": "verdict",
    "consequence": "consequence",
}


def write_audit(table: pd.DataFrame, *paths: str | Path) -> None:
    """Write the audit to each of `paths`, the suffix choosing the form: .csv, .md or .html.

    `table` is `run_audit`'s. Raises ValueError for another suffix, before anything is written.
    """
    writers: dict[str, Callable[[pd.DataFrame], str]] = {
        ".csv": _csv,
        ".md": _markdown,
        ".html": _html,
    }
    targets = [Path(path) for path in paths]
    for target in targets:
        if target.suffix not in writers:
            raise ValueError(f"{target}: the suffix must be one of {', '.join(writers)}")
    for target in targets:
        write_text(writers[target.suffix](table), target)


def _shown(value: object) -> str:
    if value is None or (isinstance(value, float) and pd.isna(value)):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def counts(table: pd.DataFrame) -> str:
    """One line: how many claims agree, disagree and cannot be computed."""
    n = table.verdict.value_counts()
    parts = (
        f"{n.get(verdict, 0)} {verdict.replace('_', ' ')}"
        for verdict in ("agrees", "disagrees", "not_computable")
    )
    return f"{len(table)} claims: {', '.join(parts)}."


def _csv(table: pd.DataFrame) -> str:
    return table.map(_shown).to_csv(index=False)


def _markdown(table: pd.DataFrame) -> str:
    def line(cells: Iterable[object]) -> str:
        return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"

    rows = [line(_shown(row[column]) for column in HEAD) for row in table.to_dict("records")]
    return "\n".join([counts(table), "", line(HEAD.values()), line("---" for _ in HEAD), *rows, ""])


def _html(table: pd.DataFrame) -> str:
    def cells(values: Iterable[object], tag: str) -> str:
        return "".join(f"<{tag}>{html.escape(str(v))}</{tag}>" for v in values)

    rows = "\n".join(
        f'<tr class="{row["verdict"]}">{cells((_shown(row[column]) for column in HEAD), "td")}</tr>'
        for row in table.to_dict("records")
    )
    style = (
        "body{font:14px sans-serif}table{border-collapse:collapse}"
        "td,th{border:1px solid #ccc;padding:3px 6px;text-align:left;vertical-align:top}"
        "tr.disagrees{background:#fbe3df}tr.not_computable{background:#eee}"
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Audit</title>'
        f"<style>{style}</style></head>\n"
        f"<body><h1>Audit of the printed figures</h1><p>{counts(table)}</p>\n"
        f"<table><thead><tr>{cells(HEAD.values(), 'th')}</tr></thead><tbody>\n{rows}\n"
        "</tbody></table></body></html>\n"
    )
