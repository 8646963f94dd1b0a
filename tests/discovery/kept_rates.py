"""Kept diagnoses count for the engine and the rules that made them. A page shows no rates of
others.

The engine is what it compiles: single contacts run no experiment of it.

The rules are the code of the diagnosis that a verdict on single contacts runs before the engine's
gains: the model of the table, the laws and the catalogue's curves, without comments, docstrings and
layout.
"""

import hashlib
from functools import cache
from pathlib import Path

import pandas as pd

from calibration.digests import SOURCES
from dem.fingerprint import code_of, kernel_fingerprint

DECIDE = (
    "table_model/*.py",
    "table_model/terms/*.py",
    "laws/*.py",
    "catalogue/[a-z]*.py",
    "chance.py",
    "collision.py",
    "fit.py",
    "measurements.py",
)
"""Files of the diagnosis that decide what is said of single contacts before the engine's gains."""

TOLD = {"next_setting.py", "engine_gain.py", "in_engine.py"}
"""Of these, what is only proposed or run afterwards."""


@cache
def present() -> dict[str, str]:
    """Digests of what the engine compiles, which are its contacts, and of the rules as they are."""
    return {"engine": kernel_fingerprint(), "rules": rules()}


def rules(sources: Path = SOURCES) -> str:
    """Digest of the rules in a folder of the packages."""
    files = sorted({f for p in DECIDE for f in (sources / "diagnosis").glob(p)})
    text = "\n".join(code_of(f.read_text()) for f in files if f.name not in TOLD)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


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
