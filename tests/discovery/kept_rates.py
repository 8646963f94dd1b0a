"""Kept diagnoses count for the engine and the rules that made them. A page shows no rates of
others.

The engine is what it compiles: single contacts run no experiment of it.

The rules are the code of the diagnosis that a verdict runs, without comments, docstrings and
layout. There are two sets of them, as no verdict runs through both: of single contacts, before the
engine's gains, the model of the table, the laws and the catalogue's curves; of bulk tests the
emulators, the fits and the gains. Tables that run experiments of the engine count for all of it.
"""

import hashlib
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from calibration.digests import SOURCES
from dem.fingerprint import code_of, engine_fingerprint, kernel_fingerprint

DECIDE = {
    "contacts": (
        "diagnosis/table_model/*.py",
        "diagnosis/table_model/terms/*.py",
        "diagnosis/laws/*.py",
        "diagnosis/catalogue/[a-z]*.py",
        "diagnosis/chance.py",
        "diagnosis/collision.py",
        "diagnosis/fit.py",
        "diagnosis/measurements.py",
    ),
    "bulk": (
        "calibration/inference/chance_of_no_value.py",
        "calibration/inference/emulator.py",
        "diagnosis/catalogue/*.py",
        "diagnosis/chance.py",
        "diagnosis/derived.py",
        "diagnosis/design.py",
        "diagnosis/few_runs.py",
        "diagnosis/emulator.py",
        "diagnosis/emulator_waves.py",
        "diagnosis/extend.py",
        "diagnosis/failures.py",
        "diagnosis/fit.py",
        "diagnosis/identify.py",
        "diagnosis/lever_laws.py",
        "diagnosis/measurements.py",
        "diagnosis/model.py",
        "diagnosis/rig.py",
        "diagnosis/scale.py",
        "diagnosis/shared_errors.py",
        "diagnosis/single_setting.py",
        "diagnosis/withdrawal.py",
    ),
}
# what runs of an engine are told beside
DECIDE["engine tables"] = (*DECIDE["bulk"], "diagnosis/untried.py")
"""Files that decide what is said of single contacts before the engine's gains, of bulk tests, and
of bulk tests whose runs an engine made."""

TOLD = {"next_setting.py", "engine_gain.py", "in_engine.py"}
"""Of these, what is only proposed or run afterwards."""


@cache
def present(of: str = "contacts") -> dict[str, str]:
    """Digests of the rules as they are and, of contacts, of what the engine compiles. The bulk
    tables that are drawn are of closed forms, which run no engine."""
    if of == "engine tables":
        return {"engine": engine_fingerprint(), "rules": rules(of="engine tables")}
    engine = {"engine": kernel_fingerprint()} if of == "contacts" else {}
    return engine | {"rules": rules(of=of)}


def rules(sources: Path = SOURCES, of: str = "contacts") -> str:
    """Digest of the rules, a key of DECIDE, in a folder of the packages."""
    files = sorted({f for p in DECIDE[of] for f in sources.glob(p)})
    text = "\n".join(code_of(f.read_text()) for f in files if f.name not in TOLD)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def fresh(rows: pd.DataFrame, of: str = "contacts") -> pd.DataFrame:
    """The rows of kept diagnoses that are of the present engine and rules."""
    now = present(of).items()
    own = [rows[k].eq(v) if k in rows else pd.Series(False, rows.index) for k, v in now]
    return rows[np.all(own, axis=0)]


def kept(path: Path, of: str = "contacts") -> pd.DataFrame:
    """The fresh rows of a table of kept diagnoses, which need not be there."""
    if not path.exists():
        return pd.DataFrame()
    return fresh(pd.read_csv(path, keep_default_na=False), of)


def begun(path: Path, of: str = "contacts") -> pd.DataFrame:
    """The fresh rows of a table of kept diagnoses, which a call goes on from; rows of another
    engine or of other rules leave the file."""
    rows = kept(path, of)
    if rows.empty:
        path.unlink(missing_ok=True)
    else:
        rows.to_csv(path, index=False)
    return rows


def shown(page: Path, mark: str) -> str:
    """The part of a page between the two comments of a mark."""
    return page.read_text().split(f"<!-- {mark} -->\n")[1].split(f"<!-- end of {mark} -->")[0]


def show(page: Path, mark: str, text: str) -> None:
    """Put a text there."""
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    old = begin + shown(page, mark) + end
    page.write_text(page.read_text().replace(old, begin + text + end))


def dated(rows: pd.DataFrame, planned: int, command: str, of: str = "contacts") -> str:
    """The sentence that stands over rates, or in their place where no fresh row is kept.

    planned: how many rows there are to be. command: what makes them.
    """
    if rows.empty:
        return (
            "No rates are shown: none is kept that is of the present engine and rules.\n"
            f"`{command}` makes them.\n"
        )
    dates = " and ".join(sorted(set(rows["date"])))
    by = " and ".join(f"{what} `{digest}`" for what, digest in present(of).items())
    return (
        f"{len(rows)} of the {planned} planned cases have been diagnosed, on {dates}, by\n{by}.\n"
    )
