"""Kept diagnoses count for the engine and the rules that made them. A page shows no rates of
others.

The rules are the code of the diagnosis that a verdict on single contacts runs, without comments,
docstrings and layout.
"""

from functools import cache
from pathlib import Path

import pandas as pd

from calibration.fresh import code_digest
from dem.fingerprint import engine_fingerprint


@cache
def present() -> dict[str, str]:
    """Digests of the engine and of the rules as they are."""
    return {
        "engine": engine_fingerprint(),
        "rules": code_digest("diagnosis.contacts", ["diagnosis"]),
    }


def fresh(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of kept diagnoses that are of the present engine and rules."""
    own = [
        rows[k].eq(v) if k in rows else pd.Series(False, rows.index) for k, v in present().items()
    ]
    return rows[own[0] & own[1]]


def kept(path: Path) -> pd.DataFrame:
    """The fresh rows of a table of kept diagnoses, which need not be there."""
    if not path.exists():
        return pd.DataFrame()
    return fresh(pd.read_csv(path, keep_default_na=False))


def shown(page: Path, mark: str) -> str:
    """The part of a page between the two comments of a mark."""
    return page.read_text().split(f"<!-- {mark} -->\n")[1].split(f"<!-- end of {mark} -->")[0]


def show(page: Path, mark: str, text: str) -> None:
    """Put a text there."""
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    old = begin + shown(page, mark) + end
    page.write_text(page.read_text().replace(old, begin + text + end))


def dated(rows: pd.DataFrame, planned: int, command: str) -> str:
    """The sentence that stands over rates, or in their place where no fresh row is kept.

    planned: how many rows there are to be. command: what makes them.
    """
    if rows.empty:
        return (
            "No rates are shown: none is kept that is of the present engine and rules.\n"
            f"`{command}` makes them.\n"
        )
    dates = " and ".join(sorted(set(rows["date"])))
    return (
        f"{len(rows)} of the {planned} planned cases have been diagnosed, on {dates}, by\n"
        f"engine `{present()['engine']}` and rules `{present()['rules']}`.\n"
    )
