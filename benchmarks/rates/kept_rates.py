"""Kept diagnoses count for the engine and the rules that made them. A page shows no rates of
others.

The engine is what it compiles: single contacts run no experiment of it. The rules are the code of
the diagnosis that a verdict runs, by decide.yaml, without comments, docstrings and layout.
"""

import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from calibration.digests import SOURCES
from calibration.engines.templates import macros
from dem.fingerprint import EQUAL, code_of, engine_fingerprint, kernel_fingerprint

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "results/reference/discovery"
PAGE = KEPT / "rates.md"
FIGURES = Path(__file__).with_name("figures.csv")
DECIDE = yaml.safe_load(Path(__file__).with_name("decide.yaml").read_text())
RUN_AFTERWARDS = {"engine_gain.py"}
"""Of the files that decide."""

WORDS = macros("benchmarks.rates", "told")
CLAIMS = ("identified", "discovered")
"""Verdicts that claim a law."""


@cache
def present(of: str) -> dict[str, str]:
    """Digests of the rules as they are, a key of DECIDE, and of the engine that runs. The bulk
    tables that are drawn are of closed forms, which run none."""
    kernel = kernel_fingerprint()
    engines = {"contacts": EQUAL.get(kernel, kernel), "engine tables": engine_fingerprint()}
    return ({"engine": engines[of]} if of in engines else {}) | {"rules": rules(of)}


def rules(of: str, sources: Path = SOURCES) -> str:
    """Digest of the rules, a key of DECIDE, in a folder of the packages."""
    files = sorted({f for p in DECIDE[of] for f in sources.glob(p)})
    read = [(f, f.read_text()) for f in files if f.name not in RUN_AFTERWARDS]
    text = "\n".join(code_of(own) if f.suffix == ".py" else own for f, own in read)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def fresh(rows: pd.DataFrame, of: str) -> pd.DataFrame:
    """The rows of kept diagnoses that are of the present engine and rules."""
    now = present(of).items()
    own = [rows[k].eq(v) if k in rows else pd.Series(False, rows.index) for k, v in now]
    return rows[np.all(own, axis=0)]


def kept(path: Path, of: str) -> pd.DataFrame:
    """The fresh rows of a table of kept diagnoses, which need not be there."""
    if not path.exists():
        return pd.DataFrame()
    return fresh(pd.read_csv(path, keep_default_na=False, na_values=[""]), of)


def share(hits: Iterable[Any]) -> tuple[int, int, float, float]:
    """Return (hits, of, low, high): how many are true of those that are not None, and the 95 %
    Wilson interval of the share."""
    own = pd.to_numeric(pd.Series(list(hits), dtype=object), errors="coerce").dropna()
    n, k = len(own), int(own.sum())
    if not n:
        return 0, 0, 0.0, 1.0
    ends = stats.binomtest(k, n).proportion_ci(method="wilson")
    return k, n, float(ends.low), float(ends.high)


def figures(trial: str, rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Return what figures.csv asks of the rows of a trial: figure, hits, of, low, high, asked (the
    share, NaN where none is) and most (whether it is so at most).

    There `among` are the rows that count, all where it is empty, and `hit` what must be true of a
    row; where there is an `of`, both are columns of how many hold and of how many.
    """
    found = []
    table = pd.read_csv(FIGURES, keep_default_na=False, na_values={"asked": [""]})
    for f in table[table["trial"] == trial].itertuples():
        own = rows.query(f.among, engine="python") if f.among else rows
        hits = own.eval(f.hit, engine="python")
        if f.of:
            held, n = (int(column.fillna(0).sum()) for column in (hits, own[f.of]))
            hits = [1] * held + [0] * (n - held)
        values = dict(zip(("hits", "of", "low", "high"), share(hits), strict=True))
        found.append({"figure": f.figure} | values | {"asked": f.asked, "most": bool(f.most)})
    return found


def f1_score(hits: int, true: int, told: int) -> float:
    """Harmonic mean of hits over what was told and hits over what is true."""
    return 2.0 * hits / max(true + told, 1)


@dataclass(frozen=True)
class Trial:
    """Cases that are diagnosed one after another, kept as rows of a table, and shown on a page.

    word : for it on the command line
    of : the rules that its rows are of, a key of DECIDE
    cases : all cases, in their order
    judged : makes the row of a case
    told : makes Markdown of rows, below the sentence that dates them
    """

    word: str
    of: str
    cases: Callable[[], Sequence[Any]]
    judged: Callable[[Any], dict[str, Any]]
    told: Callable[[pd.DataFrame], str]

    @property
    def kept(self) -> Path:
        """The table of its rows."""
        return KEPT / f"{self.word}.csv"

    def run(self) -> None:
        """Diagnose the cases behind those that are kept by the present engine and rules; all where
        the table is of others."""
        done = len(kept(self.kept, self.of))
        if not done:
            self.kept.unlink(missing_ok=True)
        for case in self.cases()[done:]:
            start = time.process_time()
            row = self.judged(case)
            row |= {"seconds": round(time.process_time() - start, 1)}
            row |= {"date": date.today().isoformat(), **present(self.of)}
            pd.DataFrame([row]).to_csv(
                self.kept, mode="a", header=not self.kept.exists(), index=False
            )
            print(row, flush=True)

    def kept_table(self) -> str:
        """Return Markdown of what is kept and fresh: the sentence that dates it, then what is told.
        A sentence alone where there is none."""
        rows = kept(self.kept, self.of)
        if rows.empty:
            return (
                "No rates are shown: none is kept that is of the present engine and rules.\n"
                f"`python -m benchmarks.rates {self.word} run` makes them.\n"
            )
        dates = " and ".join(sorted(set(rows["date"])))
        by = " and ".join(f"{what} `{digest}`" for what, digest in present(self.of).items())
        count = f"{len(rows)} of the {len(self.cases())} planned cases have been diagnosed"
        return f"{count}, on {dates}, by\n{by}.\n\n{self.told(rows)}"

    def shown(self) -> str:
        """Return what PAGE has between the comments of the trial."""
        words = self.word.replace("_", " ")
        return PAGE.read_text().split(f"<!-- {words} -->\n")[1].split(f"<!-- end of {words} -->")[0]

    def show(self) -> None:
        """Write the `kept_table` there."""
        PAGE.write_text(PAGE.read_text().replace(self.shown(), self.kept_table()))
