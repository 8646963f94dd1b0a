"""What the README's first screen says below its table, each part from the kept results;
`readme.md.j2` has the words."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.chain.joint.words import kinds
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDABLE, UNDECIDED
from paper.names import said
from paper.reference import SHORT, TABLE
from paper.release import told
from paper.reproduction.rows import NOT_COMPARABLE
from paper.reproduction.table import WHOLE

SIMULATED = {
    "Table 6": "heaps of the screening",
    "Table 8": "sliding angles",
    "Table 9": "rebounds",
    "Table 10": "heaps along the ascent",
    "Table 11": "heaps of the region",
}
"""What the paper's tables of simulated values hold."""
NUMBERS = ("none", "one", "two", "three", "four", "five", "six", "seven")


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `readme.md.j2`, from the folder of kept results."""
    kept = Path(kept)
    salt = kept / "salt"
    table = read_written(salt / TABLE, dtype={"paper": str}).set_index("id")
    printed = told.funnels(kept / "salt-printed")
    return {
        "strongest": strongest(table),
        "effects": _effects(table),
        "tables": tables(table),
        "open": _open(table, salt.name),
        "posterior": bounded(salt),
        "rigs": told.rigs(kept / "rigs"),
        "printed": printed | {"validated": told.validated(kept / "salt-printed")},
    }


def listed(items: Iterable[str]) -> str:
    """'A', 'A and B', 'A, B and C'."""
    items = list(items)
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)


def counted(number: int) -> str:
    """A number up to seven in a word."""
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def strongest(table: pd.DataFrame) -> dict[str, Any]:
    """The factor with the largest effect, ours and the paper's, of a reproduction table by id."""
    rows = table.loc[[i for i in table.index if i.startswith("table07.")]]
    rows = rows.assign(theirs=rows["paper"].astype(float), ours=rows["this_project"].astype(float))
    ours, theirs = (rows.loc[rows[c].abs().idxmax()] for c in ("ours", "theirs"))
    names = [row["quantity"].removeprefix("effect of ") for row in (ours, theirs)]
    return {
        "name": names[0],
        "effect": told.degrees(ours["ours"]),
        "paper": told.degrees(ours["theirs"]),
        "same": names[0] == names[1],
        "theirs": names[1],
    }


def _effects(table):
    """How many effects of Table 7 have each verdict, in words."""
    rows = [i for i in table.index if i.startswith("table07.")]
    n = table.loc[rows, "agreement"].value_counts()
    verdicts = (DIFFERENT, EQUIVALENT, UNDECIDABLE, UNDECIDED, NOT_COMPARABLE)
    return {v.replace(" ", "_"): counted(int(n.get(v, 0))) for v in verdicts} | {
        "all": counted(len(rows))
    }


def tables(table: pd.DataFrame) -> dict[str, list[str]]:
    """{verdict: ['sliding angles (Table 8)', ...]} of the tables of simulated values."""
    found: dict[str, list[str]] = {}
    for item in WHOLE:
        verdict = table.loc[f"{item.lower().replace(' ', '')}.whole", "agreement"]
        found.setdefault(verdict, []).append(f"{SIMULATED[item]} ({item})")
    return found


def _open(table, study):
    """{verdict: [words of the README's rows with it]}."""
    found = {UNDECIDABLE: [], UNDECIDED: []}
    for name, (words, _) in SHORT.items():
        row = name.format(study=study)
        if row in table.index and table.loc[row, "agreement"] in found:
            words = words.split(" [")[0].removesuffix(";")
            found[table.loc[row, "agreement"]].append(words)
    return found


def bounded(kept: str | Path) -> dict[str, Any]:
    """What the posterior of a study bounds, and that of all its tests: how many of the parameters,
    and each with its interval."""
    alone = read_json(Path(kept) / "posterior" / "posterior.json")["parameters"]
    every = read_json(Path(kept) / "joint" / "joint.json")
    return {
        "alone": _intervals(alone, [n for n, p in alone.items() if p["bounded"]]),
        "together": _intervals(every["parameters"], kinds(every)["bounded"]),
        "contradict": every["agreement"]["contradicts"],
    }


def _intervals(parameters, names):
    ends = {n: parameters[n]["interval"] for n in names}
    return {
        "bounded": counted(len(names)),
        "all": counted(len(parameters)),
        "intervals": [f"{said(n)} ({a:.3f} to {b:.3f})" for n, (a, b) in ends.items()],
    }
