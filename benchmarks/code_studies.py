"""One study of heaps in three codes, for `docs/evidence.md`: what each took and found, and how
heaps of the other codes differ from this engine's at the same parameters.

python -m benchmarks.code_studies CORES makes the three studies and the runs of the comparison. A
study that ends without an answer is told as that.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from calibration.chain.study import Results
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.runs.plans import read_plan
from calibration.runs.simulated import named, simulate
from calibration.runs.store import RunStore
from calibration.study.config import numbers_of, overlay
from calibration.study.factors import read_factors
from dem.io.files import write_json

KEPT = "results/reference/code-studies"
OWN = "in-dem"
STUDIES = ("in-liggghts", "in-lammps", OWN)
CONFIG = "examples/other-codes/config.yaml"
"""It holds each factor at the level with which the heaps were made that count as measured."""
LAID_OVER = ((), ("examples/other-codes/lammps.yaml",), ("examples/other-codes/dem.yaml",))
METRIC = "angle_of_repose_deg"
FACTORS = "examples/other-codes/factors.tsv"
TABLES = (
    "screening.json", "ascent.json", "response_surface.json", "optimum.json", "validation.json",
    "posterior.json", "parameters.csv", "verdict.json",
)  # fmt: skip
POINTS = ("screening", "response_surface")
"""Stages whose points are compared."""
CHAIN = ("screening", "ascent", "response_surface", "optimise", "validation")
OURS = {"engine": None, "laws": {"torsion": "marshall"}}
SEEDS_APART = 5000
"""Our heaps of the comparison have seeds of their own."""


def collect_study(study: Path, target: Path) -> None:
    """Keep the tables of one study in a folder, and compare another code's heaps with ours, which
    are poured now."""
    for path in (p for name in TABLES for p in study.glob(f"*/{name}")):
        (target / path.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target / path.parent.name)
    write_json(target / "times.json", times(study))
    if study.name != OWN:
        write_json(target / "comparison.json", compared(study))


def times(study: Path) -> dict[str, Any]:
    """How many runs a study had, without a value too, and why it ended before its validation, if it
    did."""
    store, specs = RunStore(study.parent / "runs"), {}  # type: ignore[var-annotated]
    for plan in sorted(study.rglob("plan.json")):  # the diagnosis has some a level further down
        specs |= read_plan(plan)
    results = [r for name in specs if (r := store.current(name))]
    return {
        "runs": len(specs),
        "without_value": len(specs) - sum(METRIC in r["metrics"] for r in results),
        "ended": ended(study),
    }


def ended(study: Path) -> dict[str, str] | None:
    """{stage, reason} of the stage of the chain at which a study ended without an answer, as its
    log says; None where it was validated."""
    done = Results(study)
    for stage in CHAIN:
        if done.summary(stage) is None:
            log = (study / "logs" / f"{stage}.log").read_text("utf-8").strip()
            return {"stage": stage.replace("_", " "), "reason": log.split("\n")[-1]}
    return None


def compared(study: Path) -> dict[str, Any]:
    """How another code's heaps at the points of its study differ from ours, a row a point: the
    number of points with heaps of both and of those without, the root mean square of the
    differences, what seeds alone make of it, the chance of that much (chi-square), and the mean
    difference, theirs less ours, with its standard error [deg]."""
    specs, angles = [], []
    for stage in POINTS:
        plan = read_plan(study / stage / "plan.json")
        table = read_written(study / stage / "runs.csv").dropna(subset=["response"])
        specs += [plan[name] for name in table["run_id"]]
        angles += list(table["response"])
    keys = [f.key for f in read_factors(FACTORS)]
    levels = [tuple(map(numbers_of(spec).get, keys)) for spec in specs]
    heaps = pd.DataFrame({"theirs": angles, "ours": ours_at(specs, study.parent / "runs")})
    points = heaps.groupby(pd.Series(levels), sort=False).mean()
    off, spread = (points["theirs"] - points["ours"]).dropna(), apart(study)
    return {
        "points": len(off),
        "rms": float(np.sqrt(np.mean(off**2))),
        "spread": spread,
        "p": float(stats.chi2.sf(np.sum(off**2) / spread**2, len(off))),
        "mean": {"difference": float(off.mean()), "se": float(off.sem())},
        "without_value": len(points) - len(off),
    }


def ours_at(specs: list[dict[str, Any]], root: Path) -> np.ndarray:
    """(n,) angles [deg] of this engine at the points of run specs of another code; NaN where no
    heap stands."""
    own = []
    for spec in specs:
        plain = {key: value for key, value in spec.items() if key != "engine"}
        own.append(overlay(plain, OURS | {"seed": spec["seed"] + SEEDS_APART}))
    metrics = simulate(named(own), root)
    values = [metrics[name] for spec in own for name in named([spec])]
    return np.array([(m or {}).get(METRIC, np.nan) for m in values])


def apart(study: Path) -> float:
    """Standard deviation [deg] of the difference of two heaps, theirs and ours, that differ by
    their seeds alone: at the optimum of their study, which they poured to validate it."""
    theirs = read_json(study / "validation" / "validation.json")["simulated_sd"]
    specs = list(read_plan(study / "validation" / "plan.json").values())
    ours = ours_at(specs, study.parent / "runs")
    return float(np.hypot(theirs, np.nanstd(ours, ddof=1)))


if __name__ == "__main__":
    SNAKEMAKE = (sys.executable, "-m", "snakemake", f"-j{sys.argv[1]}", "--configfile", CONFIG)
    for files in LAID_OVER:
        subprocess.run([*SNAKEMAKE, *files], check=False)
    for name in STUDIES:
        collect_study(Path("results") / name, Path(KEPT) / name)
