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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from benchmarks.rates.foreign_studies import DENSITIES, FACTORS, HEAPS, SHEARS, SILOS, study
from benchmarks.rates.kept_rates import KEPT, ROOT, Trial
from diagnosis.derived import MOST_RUNS
from diagnosis.verdict import validate

TABLES = Path(__file__).with_name("foreign")
RUNS = Path(tempfile.gettempdir()) / "engine-tables"
DEFAULT = MOST_RUNS
"""Runs of this engine: what a study of such rigs has that gives no time."""

NAMED = ("identified", "discovered")
TOLD = (*NAMED, "ambiguous")
ATTRACTIONS = ("cohesion", "liquid_bridge")


@dataclass(frozen=True)
class Expected:
    """What is hidden in a table, and what its diagnosis may say: its verdicts, the slot of the law
    that leads, and no mechanism beside `names`."""

    hidden: str
    study: dict[str, Any]
    verdicts: tuple[str, ...]
    slots: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

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
    "heaps_dry": Expected("nothing", HEAPS, ("adequate",)),
    "heaps_wet": Expected("attraction", HEAPS, NAMED, ("attraction",), ATTRACTIONS),
    # of another form than the catalogue's: it may be called by these names, if it shows at all
    "heaps_sjkr": Expected("attraction", HEAPS, TOLD, ("attraction",), ATTRACTIONS),
    # the catalogue has the first; a coefficient can take it up, as it acts alike at all sizes
    "heaps_long": Expected(
        "long grains", HEAPS, ("adequate", *TOLD), ("grain_shape", "rolling_law"),
        ("grain_shape", "rolling_law"),
    ),
    # what no mechanism of the catalogue is: none may be named
    "heaps_opened": Expected("another pour", HEAPS, ("adequate", "unexplained", "error")),
    "heaps_two_sizes": Expected("two sizes", HEAPS, ("adequate", "unexplained", "error")),
    "heaps_read_low": Expected("a cone read too low", HEAPS, ("error",)),
    "silo_dry": Expected("nothing", SILOS, ("adequate",)),
    "silo_cohesive": Expected("attraction", SILOS, NAMED, ("attraction",), ("cohesion",)),
    "silo_clogged": Expected("attraction", SILOS, TOLD, ("attraction",), ("cohesion",)),
    "shear_dry": Expected("nothing", SHEARS, ("adequate",)),
    # over the load alone an attraction is the same formula as a load that was not counted
    "shear_cohesive": Expected(
        "attraction", SHEARS, TOLD, ("attraction", "load"), (*ATTRACTIONS, "uncounted_load")
    ),
    "shear_falling": Expected(
        "friction over the load", SHEARS, TOLD, ("friction", "static_friction"),
        ("stress_dependent_friction",),
    ),
    "density_dry": Expected("nothing", DENSITIES, ("adequate",)),
    "density_cohesive": Expected("attraction", DENSITIES, TOLD, ("attraction",), ("cohesion",)),
}  # fmt: skip
"""Written before a run of each table was made."""

CASES = [(name, DEFAULT) for name in EXPECTED]
"""Tables and their budgets."""


def names_in(verdict: dict[str, Any]) -> set[str]:
    """All mechanisms that a verdict puts forward."""
    return {*verdict["causes"], *(n for law in verdict["laws"] for n in law["names"])}


def diagnosed(folder: Path, name: str, what: dict[str, Any], runs: int) -> dict[str, Any]:
    """verdict.json of a table of `foreign/`, by one call of the workflow in a folder; the runs that
    were planned under `made`."""
    (folder / "factors.tsv").write_text(FACTORS)
    config = study(name, what, TABLES / f"{name}.csv", runs)
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(config))
    command = [sys.executable, "-m", "snakemake", "-j1", "--workflow-profile", "none"]
    command += ["--snakefile", str(ROOT / "workflow/Snakefile"), "--configfile", f"{name}.yaml"]
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


def row_of(name: str, budget: int, verdict: dict[str, Any]) -> dict[str, Any]:
    """Return what is kept of a verdict."""
    expected = EXPECTED[name]
    return {
        "case": name, "budget": budget, "hidden": expected.hidden, "verdict": verdict["verdict"],
        "laws": "; ".join(law["slot"] for law in verdict["laws"]),
        "names": "; ".join(sorted(names_in(verdict))),
        "clogged": sum(row["failed"] for row in verdict.get("outcomes") or ()),
        "p": round(verdict["lack_of_fit"]["p"], 4), "family_p": round(verdict["family_p"], 4),
        "left": round(left(verdict), 2), "made": verdict["made"], "met": int(expected.met(verdict)),
        "reason": verdict["reason"][:160],
    }  # fmt: skip


def judged(case: tuple[str, int]) -> dict[str, Any]:
    """Return the row of a table and a budget. Tables share their runs."""
    RUNS.mkdir(exist_ok=True)
    name, budget = case
    return row_of(name, budget, diagnosed(RUNS, name, EXPECTED[name].study, budget))


def told(rows: pd.DataFrame) -> Iterator[str]:
    """Yield lines of Markdown: a row a table."""
    heads = ("table", "hidden", "left [sd]", "verdict", "place", "names", "p", "runs")
    heads += ("as expected",)
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    known = rows.fillna("").set_index(["case", "budget"])
    for r in known.loc[[case for case in CASES if case in known.index]].itertuples():
        table = r.Index[0].replace("_", ", ", 1).replace("_", " ")
        said = (table, r.hidden, f"{r.left:.1f}", f"`{r.verdict}`", r.laws)
        said += (r.names.replace("_", " "), f"{r.p:.2g}", r.made, "yes" if r.met else "no")
        yield f"| {' | '.join(map(str, said))} |"


TRIAL = Trial(
    "engine tables", KEPT / "engine_tables.csv", "engine tables", lambda: CASES,
    lambda case: {"case": case[0], "budget": case[1]}, judged, told,
)  # fmt: skip
