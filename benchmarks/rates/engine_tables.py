"""Tables of heaps, silos, shear cells and densities, by this engine or by LIGGGHTS, with a law that
the study lacks or without one. Each goes through the diagnosis unattended: no settings are written,
and no more runs are made than the budget.

The tables stand in `foreign/`, each with what made it. Those of a kind share the runs that train
the emulators, in a folder that is kept until all are diagnosed.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from benchmarks.rates.foreign_studies import FACTORS, FIXED, STUDIES, TABLES, read
from benchmarks.rates.kept_rates import CLAIMS, ROOT, WORDS, Trial
from diagnosis.setup import MOST_RUNS
from diagnosis.verdict import validate

RUNS = Path(tempfile.gettempdir()) / "engine-tables"
"""Of this engine."""

TOLD = (*CLAIMS, "ambiguous")


@dataclass(frozen=True)
class Expected:
    """What is hidden in a table, and what its diagnosis may say, as expected.yaml has it."""

    hidden: str
    study: dict[str, Any]
    verdicts: Sequence[str]
    slots: Sequence[str] = ()
    names: Sequence[str] = ()

    def met(self, verdict: dict[str, Any]) -> bool:
        """Return whether the content of verdict.json is so."""
        leading = {law["slot"] for law in verdict["laws"][:1]}
        return (
            verdict["verdict"] in self.verdicts
            and names_in(verdict) <= set(self.names)
            and leading <= set(self.slots)
            and bool(leading) == (verdict["verdict"] in TOLD)
        )


EXPECTED = {
    name: Expected(**own | {"study": STUDIES[own["study"]]})
    for name, own in read("expected.yaml").items()
}


def names_in(verdict: dict[str, Any]) -> set[str]:
    """All mechanisms that a verdict puts forward."""
    return {*verdict["causes"], *(n for law in verdict["laws"] for n in law["names"])}


def diagnosed(folder: Path, name: str) -> dict[str, Any]:
    """verdict.json of a table of `foreign/`, by one call of the workflow in a folder, with as many
    runs as a study of such rigs has that gives no time; those that were planned under `made`."""
    (folder / "factors.tsv").write_text(FACTORS)
    config = EXPECTED[name].study | {
        "name": name, "factors": "factors.tsv", "measurements": str(TABLES / f"{name}.csv"),
        "fixed": FIXED, "diagnosis": {"runs": MOST_RUNS, "batches": 2},
    }  # fmt: skip
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(config))
    command = [sys.executable, "-m", "snakemake", "-j1", "--workflow-profile", "none"]
    command += ["--snakefile", str(ROOT / "workflow/Snakefile"), "--configfile", f"{name}.yaml"]
    # as profiles/default has it: a fresh checkout changes no code
    command += ["--rerun-triggers", "mtime", "params", "input", "software-env"]
    said = subprocess.run(
        [*command, "--", "diagnose"], cwd=folder, check=False, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    if said.returncode:
        raise RuntimeError(said.stdout)
    found = folder / "results" / name / "diagnosis"
    plans = [found / "plan.json", *found.glob("*/plan.json")]
    planned = {run for plan in plans for run in json.loads(plan.read_text())}
    verdict = json.loads((found / "verdict.json").read_text())
    validate(verdict)
    return verdict | {"made": len(planned)}


def left(verdict: dict[str, Any]) -> float:
    """Distance that the readings leave of the base model at its best, with their errors alone, in
    standard deviations: the root of chi-square beyond its degrees of freedom. What a table has left
    to find; no way to judge beats it."""
    off = [(r["measured"] - r["predicted"]) / r["reading_sd"] for r in verdict["residuals"]]
    return max(sum(x**2 for x in off) - verdict["lack_of_fit"]["freedom"], 0.0) ** 0.5


def judged(name: str) -> dict[str, Any]:
    """Return the row of a table. Tables share their runs."""
    RUNS.mkdir(exist_ok=True)
    expected, verdict = EXPECTED[name], diagnosed(RUNS, name)
    return {
        "case": name, "budget": MOST_RUNS, "hidden": expected.hidden, "verdict": verdict["verdict"],
        "laws": "; ".join(law["slot"] for law in verdict["laws"]),
        "names": "; ".join(sorted(names_in(verdict))),
        "clogged": sum(row["failed"] for row in verdict.get("outcomes") or ()),
        "p": round(verdict["lack_of_fit"]["p"], 4), "family_p": round(verdict["family_p"], 4),
        "left": round(left(verdict), 2), "made": verdict["made"], "met": int(expected.met(verdict)),
        "reason": verdict["reason"][:160],
    }  # fmt: skip


def told(rows: pd.DataFrame) -> str:
    """Return Markdown: a row a table."""
    ordered = rows.fillna("").sort_values("case", key=lambda case: case.map([*EXPECTED].index))
    return WORDS.engine_tables(ordered.to_dict("records"))


TRIAL = Trial("engine_tables", "engine tables", lambda: [*EXPECTED], judged, told)
