"""Kept diagnoses count for the engine and the rules that made them. A page shows no rates of
others.

The engine is what it compiles: single contacts run no experiment of it.

The rules are the code of the diagnosis that a verdict runs, without comments, docstrings and
layout. There are two sets of them, as no verdict runs through both: of single contacts, before the
engine's gains, the model of the table, the laws and the catalogue's curves; of bulk tests the
emulators, the fits and the gains. Tables that run experiments of the engine count for all of it.
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
from scipy import stats

from calibration.digests import SOURCES
from calibration.engines.templates import macros
from dem.fingerprint import EQUAL, code_of, engine_fingerprint, kernel_fingerprint

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "results/reference/discovery"
PAGE = KEPT / "rates.md"
COMMAND = "python -m benchmarks.rates"
FIGURES = Path(__file__).with_name("figures.csv")
DECIDE = {
    "contacts": ["diagnosis/laws.json", *(f"diagnosis/{name}.py" for name in (
        "table_model/* laws/* catalogue/* chance fit measurements reading_errors rules"
    ).split())],
    "bulk": ["calibration/inference/chance_of_no_value.py", "diagnosis/laws.json",
             "diagnosis/setup.json", *(f"diagnosis/{name}.py" for name in (
        "table_model/* laws/* catalogue/* bulk chance design emulator emulator_waves extend fit "
        "lever_laws measurements model reading_errors response rig rules setup verdict"
    ).split())],
}  # fmt: skip
DECIDE["engine tables"] = DECIDE["bulk"]
"""Files that decide what is said of single contacts before the engine's gains, of bulk tests, and
of bulk tests whose runs an engine made."""

TOLD = {"engine_gain.py"}
"""Of these, what is only run afterwards."""


@cache
def present(of: str = "contacts") -> dict[str, str]:
    """Digests of the rules as they are and, of contacts, of what the engine compiles. The bulk
    tables that are drawn are of closed forms, which run no engine."""
    if of == "engine tables":
        return {"engine": engine_fingerprint(), "rules": rules(of="engine tables")}
    kernel = kernel_fingerprint()
    engine = {"engine": EQUAL.get(kernel, kernel)} if of == "contacts" else {}
    return engine | {"rules": rules(of=of)}


def rules(sources: Path = SOURCES, of: str = "contacts") -> str:
    """Digest of the rules, a key of DECIDE, in a folder of the packages."""
    files = sorted({f for p in DECIDE[of] for f in sources.glob(p)})
    read = [(f, f.read_text()) for f in files if f.name not in TOLD]
    text = "\n".join(code_of(own) if f.suffix == ".py" else own for f, own in read)
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


def told(trial: str, *values: Any) -> str:
    """Return the Markdown of a trial, by a macro of told.j2."""
    return getattr(macros("benchmarks.rates", "told"), trial)(*values)


@dataclass(frozen=True)
class Trial:
    """Cases that are diagnosed one after another, kept as rows of a table, and shown on a page.

    word : for it on the command line
    of : the rules that its rows are of, a key of DECIDE
    cases : names all cases
    judged : makes the row of a case
    told : makes Markdown of rows, below the sentence that dates them
    name : {column: value} by which a kept row is known to be a case's
    folder : of the table of its rows, which a call goes on from
    """

    word: str
    of: str
    cases: Callable[[], Sequence[Any]]
    judged: Callable[[Any], dict[str, Any]]
    told: Callable[[pd.DataFrame], str]
    name: Callable[[Any], dict[str, Any]] = lambda case: {"case": case.name}
    folder: Path = KEPT

    @property
    def kept(self) -> Path:
        """The table of its rows."""
        return self.folder / f"{self.word}.csv"

    def run(self, count: int | None = None) -> None:
        """Diagnose the cases, the first `count` of them, that are not kept by the present engine
        and rules. Rows of others leave the table."""
        rows = kept(self.kept, self.of)
        if rows.empty:
            self.kept.unlink(missing_ok=True)
        else:
            rows.to_csv(self.kept, index=False)
        for case in self.cases()[:count]:
            name = self.name(case)
            if len(rows) and (rows[list(name)].fillna("") == pd.Series(name)).all(axis=1).any():
                continue
            start = time.process_time()
            row = self.judged(case)
            row |= {"seconds": round(time.process_time() - start, 1)}
            row |= {"date": date.today().isoformat(), **present(self.of)}
            begun = self.kept.exists()
            columns = pd.read_csv(self.kept, nrows=0).columns if begun else None
            pd.DataFrame([row], columns=columns).to_csv(
                self.kept, mode="a", header=not begun, index=False
            )
            print(row, flush=True)

    def table(self, rows: pd.DataFrame) -> str:
        """Return Markdown of fresh rows: the sentence that dates them, then what is told. A
        sentence alone where there is none."""
        if rows.empty:
            return (
                "No rates are shown: none is kept that is of the present engine and rules.\n"
                f"`{COMMAND} {self.word} run` makes them.\n"
            )
        dates = " and ".join(sorted(set(rows["date"])))
        by = " and ".join(f"{what} `{digest}`" for what, digest in present(self.of).items())
        count = f"{len(rows)} of the {len(self.cases())} planned cases have been diagnosed"
        return f"{count}, on {dates}, by\n{by}.\n\n{self.told(rows)}"

    def kept_table(self) -> str:
        """Return the `table` of what is kept and fresh."""
        return self.table(kept(self.kept, self.of))

    def _marks(self) -> tuple[str, str]:
        words = self.word.replace("_", " ")
        return f"<!-- {words} -->\n", f"<!-- end of {words} -->"

    def shown(self) -> str:
        """Return what PAGE has between the comments of the trial."""
        begin, end = self._marks()
        return PAGE.read_text().split(begin)[1].split(end)[0]

    def show(self) -> None:
        """Write the `kept_table` there."""
        begin, end = self._marks()
        old, new = (begin + text + end for text in (self.shown(), self.kept_table()))
        PAGE.write_text(PAGE.read_text().replace(old, new))
