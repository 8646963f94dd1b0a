"""The campaign's commands; see the package."""

import json
import os
import sys
import time
import traceback
from datetime import date
from pathlib import Path

import kept_rates
import pandas as pd

from . import cases, score

ROOT = Path(__file__).parents[3]
KEPT = Path(os.environ.get("STRANGERS", ROOT / "results/reference/discovery/strangers.csv"))
GAINS = KEPT.with_name("strangers_gains.csv")
MOST_GAINS = 24
"""Cases of which the engine is asked as well: the first of the campaign at ten standard errors
whose law the catalogue has."""

PAGE, MARK = ROOT / "results/reference/discovery/rates.md", "strangers"


def diagnosed(case, engine=False):
    """The row of a case, and what was said; engine: with its runs."""
    from . import ask  # loads the engine

    drawn, start = case.draw(), time.process_time()
    try:
        said = (ask.ask_engine if engine else ask.ask)(drawn.table)
    except Exception as error:
        traceback.print_exc(limit=-3)
        said = {"verdict": "failed", "reason": f"{type(error).__name__}: {error}"}
    seconds = time.process_time() - start
    row = {"case": case.name, "kind": case.kind, "group": case.group, "strength": case.strength,
           "seed": case.seed, **score.marks(case, drawn, said), "seconds": round(seconds, 1),
           "reason": str(said.get("reason", "")).replace("\n", " ")[:200],
           "date": date.today().isoformat(), **kept_rates.present()}  # fmt: skip
    return row, said


def chosen(words):
    """Cases by name, or all of the campaign of a kind or a group."""
    for word in words:
        if "@" in word:
            yield cases.case(word)
        elif word in ("fixed", "middle"):
            yield from {"fixed": cases.FIXED, "middle": cases.MIDDLE}[word]
        else:
            own = [
                c for c in cases.campaign() if word in (c.kind, c.kind.replace(" ", "_"), c.group)
            ]
            if not own:
                raise SystemExit(f"{word}: no case, kind or group; python -m strangers list")
            yield from own


def show(words):
    for case in chosen(words):
        drawn = case.draw()
        print(f"# {case.name}: {[law.name for law in drawn.laws]} {list(drawn.faults)}")
        print(drawn.table.to_csv(index=False))


def attempt(words):
    for case in chosen(words):
        row, said = diagnosed(case)
        print(json.dumps(said, indent=1, default=str)[:6000])
        print({k: v for k, v in row.items() if v is not None and v != ""}, flush=True)


def engine(words):
    """What the engine says of the names: verdict, and the interval of each law's gain."""
    for case in chosen(words):
        row, said = diagnosed(case, engine=True)
        for law in said.get("laws", []):
            ends = (law["gain"] or {}).get("held_out_rmse_difference_interval")
            print(case.name, said["verdict"], law["slot"], law["state"], law["names"], ends)
        print(case.name, f"{row['name_loses']=} {row['seconds']=} {row['reason']}", flush=True)


def of_gains():
    """The cases of GAINS, fixed beforehand."""
    own = [
        c
        for c in cases.campaign()
        if c.group in ("law", "two laws")
        and c.strength == 10.0
        and all(law.names for law in c.draw().laws)
    ]
    return own[:MOST_GAINS]


def gains(words):
    """Ask the engine of the cases of GAINS that it lacks."""
    rows = kept_rates.fresh(read(GAINS))
    known = set() if rows.empty else set(rows["case"])
    for case in of_gains():
        if case.name in known:
            continue
        row, said = diagnosed(case, engine=True)
        ends = [(law["gain"] or {}).get("held_out_rmse_difference_interval") or (None, None)
                for law in said.get("laws", [])]  # fmt: skip
        row["gains"] = "; ".join(f"{a:.2f} to {b:.2f}" for a, b in ends if a is not None)
        row["withdrawn"] = "; ".join(n for law in said["laws"] for n in law.get("withdrawn", []))
        pd.DataFrame([row]).to_csv(GAINS, mode="a", header=not GAINS.exists(), index=False)
        print(row["case"], row["verdict"], row["names"], row["gains"], row["seconds"], flush=True)


def run(words):
    """Every PARTS-th case that the kept file lacks, among the campaign's first LIMIT."""
    part, parts = (int(w) for w in (*words, 0, 1)[:2]) if len(words) >= 2 else (0, 1)
    limit = int(words[2]) if len(words) > 2 else len(cases.campaign())
    for case in cases.campaign()[:limit][part::parts]:
        if case.name in done():
            continue
        row, _ = diagnosed(case)
        pd.DataFrame([row]).to_csv(KEPT, mode="a", header=not KEPT.exists(), index=False)
        print(row["case"], row["verdict"], row["laws"], row["errors"], row["rows"], flush=True)


def read(path):
    """A table of kept rows; `null` is a group's name. Empty where there is none."""
    if not Path(path).exists():
        return pd.DataFrame()
    return pd.read_csv(path, keep_default_na=False, na_values=[""])


def done():
    """Names of the cases that are kept and of the present engine and rules."""
    rows = kept_rates.fresh(read(KEPT))
    return set() if rows.empty else set(rows["case"])


def tell(words):
    rows = read(words[0] if words else KEPT)
    print(f"{len(rows)} of {len(cases.campaign())} cases")
    print(score.rates(rows).to_string(index=False, float_format="%.3f"))
    columns = ["case", "verdict", "laws", "names", "errors", "rows", "own_p"]
    print(score.missed(rows)[columns].to_string(index=False, float_format="%.2g"))


def table(rows, gains=None):
    """Markdown of the rates of fresh rows; a sentence where there is none.

    gains: rows of cases of which the engine was asked as well: of its word those count."""
    first = kept_rates.dated(rows, len(cases.campaign()), "python -m strangers run")
    if rows.empty:
        return first
    lines = [first, "| | share (95 % interval) | asked |", "|---|---|---|"]
    rates = score.rates(rows).set_index("figure", drop=False)
    if gains is not None and len(gains):
        rates.loc[score.LOSES] = score.rates(gains).set_index("figure", drop=False).loc[score.LOSES]
    for r in rates.itertuples():
        asked = "" if pd.isna(r.asked) else f"{'at most ' * r.most}{r.asked:.0%}"
        share = f"{r.hits} of {r.of} ({r.low:.0%} to {r.high:.0%})" if r.of else "not drawn"
        lines.append(f"| {r.figure} | {share} | {asked} |")
    return "\n".join(lines) + "\n"


def kept_table():
    """`table` of what is kept and fresh."""
    return table(*(kept_rates.fresh(read(path)) for path in (KEPT, GAINS)))


def write(words):
    """Put the table of the kept rows into the documentation."""
    kept_rates.show(PAGE, MARK, kept_table())


def names(words):
    for case in cases.campaign():
        print(f"{case.group:16s} {case.name}")


if __name__ == "__main__":
    what, *rest = sys.argv[1:] or ["list"]
    {
        "list": names,
        "show": show,
        "try": attempt,
        "engine": engine,
        "gains": gains,
        "run": run,
        "score": tell,
        "table": write,
    }[what](rest)
