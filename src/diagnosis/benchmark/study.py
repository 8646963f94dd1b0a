"""The benchmark of the diagnosis: hidden effects, nulls, decoys, pairs and unknown causes, all
through the engine.

Every case simulates its data with the real engine (`hidden.draw`) and diagnoses them with the
emulators. The truth is looked at only after the verdict. Base parameters are drawn for a number of
points. Cases at one point share the runs of the experiments that their effects do not touch. Each
has readings and noise of its own. A finished case is kept under the content of all that decides it,
so an interrupted benchmark goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from calibration import figures as common
from calibration.files import read_json, write_table, write_text
from calibration.intake.tables import read_written
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from diagnosis.benchmark import hidden
from diagnosis.benchmark.effect import MODERATE
from diagnosis.benchmark.figure import benchmark_figure
from diagnosis.benchmark.laboratory import DECOYS, Case, Laboratory
from diagnosis.benchmark.page import page
from diagnosis.catalogue import load_catalogue
from diagnosis.declared import SHARDS
from diagnosis.design import plan
from diagnosis.emulator_files import read_emulators
from diagnosis.model import Emulated
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of, read_settings
from diagnosis.stages import train_all

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.config import Config
    from diagnosis.settings import Settings


MECHANISMS = {
    "grains": (
        "viscoelastic_restitution",
        "plastic_restitution",
        "air_drag",
        "liquid_bridge",
        "wall_adhesion",
        "apex_sampling",
        "tilt_detection_lag",
        "stress_dependent_friction",
    ),
    "heap": ("cohesion", "rolling_law", "grain_shape", "size_bias"),
    "shear": ("uncounted_load",),
}
"""Bench -> the mechanisms that are hidden on it: single grains that drop and slide, heaps beside
drops or beside a shear cell."""

PAIRS = (
    ("viscoelastic_restitution", "tilt_detection_lag"),
    ("air_drag", "stress_dependent_friction"),
    ("plastic_restitution", "stress_dependent_friction"),
)

NULLS, NULL_POINTS = 40, 8
DRAWS = 8  # of each mechanism, a point each
FEW = {"grains": 4, "heap": 2, "shear": 2}
"""Draws of each at half the size, and of data that do not tell."""
WEAKER = 0.5  # size over that of a moderate effect
FIRST = 1000  # of the points and seeds: those below were looked at while the method was made
SHOW = ("figure.py", "figures.py", "page.py")
"""Modules that only show outcomes; a case depends on all others of the diagnosis."""


def cases(first: int = FIRST) -> list[Case]:
    """All cases, the cheap re-uses after the data they re-use; `first` moves all seeds and points
    to others."""
    out = [Case("no effect", (), 0.0, s, s % NULL_POINTS) for s in range(NULLS)]
    out += _hidden_cases("grains")
    out += [replace(c, case=k) for k in DECOYS for c in out[: NULLS // 2]]
    out += [Case("pair", p, 1.0, 200 + s, s) for p in PAIRS for s in range(DRAWS // 2)]
    for k, bench in enumerate(("heap", "shear")):
        out += [Case("no effect", (), 0.0, 400 + 50 * k + s, s, bench) for s in range(NULL_POINTS)]
        out += _hidden_cases(bench)
    out += [
        Case("undecided", (m,), 1.0, 300 + s, s, bench)
        for pair, (bench, _) in hidden.ALIKE.items()
        for m in pair
        for s in range(FEW[bench])
    ]
    out += [
        Case("mechanism", (m,), WEAKER, 100 + s, s, bench)
        for bench in MECHANISMS
        for m in MECHANISMS[bench]
        for s in range(FEW[bench])
    ]
    return [replace(c, seed=c.seed + first, point=c.point + first) for c in out]


def _hidden_cases(bench):
    """The same data with and without the mechanism in the catalogue, one after the other."""
    return [
        Case(kind, (m,), 1.0, 100 + s, s, bench)
        for m in MECHANISMS[bench]
        for s in range(DRAWS)
        for kind in ("mechanism", "removed")
    ]


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Rates with their 95 % Wilson intervals: power by mechanism and strength, false alarms,
    decoys, pairs."""
    rows = []

    def add(name, hits):
        hits = np.asarray(hits, bool)
        if len(hits):
            low, high = wilson(int(hits.sum()), len(hits))
            rows.append(
                {"what": name, "share": hits.mean(), "low": low, "high": high, "n": len(hits)}
            )

    of = {case: own for case, own in table.groupby("case")}
    none = table.iloc[:0]
    null, full = of.get("no effect", none), of.get("mechanism", none)
    for bench, own in null.groupby("bench"):
        add(f"no effect, {bench}: adequate", own["verdict"] == "adequate")
        add(f"no effect, {bench}: identified", own["verdict"] == "identified")
    for case in DECOYS:
        add(f"{case}: identified", of.get(case, none)["verdict"] == "identified")
    at = full[full["strength"] == 1.0]
    sure = at["verdict"] == "identified"
    add("all mechanisms, strength 1: named first", at["named_first"])
    moderate = at["size"] >= MODERATE
    add("as large as moderate: named first", at.loc[moderate, "named_first"])
    add("at no strength so large: named first", at.loc[~moderate, "named_first"])
    add("all mechanisms, strength 1: among the causes", at["among_causes"])
    add("all mechanisms, strength 1: identified and right", sure & (at["outcome"] == at["truth"]))
    add("all mechanisms, strength 1: identified and wrong", sure & (at["outcome"] != at["truth"]))
    for (name, strength), own in full.groupby(["truth", "strength"]):
        add(f"{name}, strength {strength:g}: named first", own["named_first"])
    outside = of.get("removed", none)
    add("outside the catalogue: identified", outside["verdict"] == "identified")
    for name, own in outside.groupby("truth"):
        add(f"{name} outside the catalogue: identified", own["verdict"] == "identified")
    pairs = of.get("pair", none)
    add("pairs: both named", pairs["among_causes"])
    for name, own in pairs.groupby("truth"):
        add(f"{name}: both named", own["among_causes"])
    _add_undecided(add, of.get("undecided", none))
    return pd.DataFrame(rows)


def _add_undecided(add, table):
    """Data on which two mechanisms look alike: at first not told apart, then with what the
    diagnosis asked for."""
    add("too little data: ambiguous", table["verdict"] == "ambiguous")
    sure = table["verdict"] == "identified"
    right = table["outcome"] == table["truth"]
    add("too little data: identified and right", sure & right)
    add("too little data: identified and wrong", sure & ~right)
    open_at_first = table[table["verdict"] == "ambiguous"]
    for k in (1, 2):
        if len(open_at_first):
            solved = open_at_first[f"outcome_{k}_further"] == open_at_first["truth"]
            add(f"ambiguous, and {k} proposed measurements more: identified and right", solved)


def wilson(hits: int, n: int) -> tuple[float, float]:
    """95 % Wilson interval of a share."""
    z = 1.959964
    centre = (hits + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * np.sqrt(hits * (n - hits) / n + z * z / 4)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def _factors(config, settings):
    """Factors calibrated on any experiment."""
    return parameters_of(settings, config.factors, list(settings.experiments))


def _rig(config, settings):
    return Rig(settings, config.run, tuple(_factors(config, settings)))


def plan_runs(config: Config, settings: Settings, output: NamedFiles) -> None:
    """Write the design and plan of the emulators of all experiments."""
    kinds = list(settings.experiments)
    rows, specs = plan(_rig(config, settings), load_catalogue(), kinds)
    write_json(output.design, rows)
    write_json(output.plan, specs)


def emulate(config: Config, settings: Settings, source: NamedFiles, output: NamedFiles) -> None:
    """Train the emulators of all experiments with the finished runs."""
    train_all(settings, _factors(config, settings), source, output)


def equip(config: Config, settings: Settings, source: NamedFiles) -> Laboratory:
    """The `Laboratory` of all benches."""
    emulators, failures = read_emulators(source.emulators)
    factors, known = _factors(config, settings), load_catalogue()
    emulated = Emulated(emulators, settings, factors, known, failures)
    return Laboratory(emulated, _rig(config, settings), settings.replicates)


def run_shard(
    config: Config,
    settings: Settings,
    source: NamedFiles,
    shard: int,
    shards: int,
    folder: str | Path,
    table: str | Path,
) -> None:
    """Diagnose the cases whose point falls to this shard: cases that share runs share a shard."""
    own = [c for c in cases() if c.point % shards == shard]
    out = run_cases(own, config, settings, source, folder)
    write_table(pd.DataFrame(out), table)


def run_cases(
    some: Sequence[Case], config: Config, settings: Settings, source: NamedFiles, folder: str | Path
) -> list[dict[str, Any]]:
    """Rows of the given cases, those that are kept in `folder` from there."""
    key = _key(config, settings, source.plan)
    laboratory, out = None, []
    for case in some:
        kept = Path(folder) / f"{_name(case, key)}.json"
        if not kept.exists():
            laboratory = laboratory or equip(config, settings, source)
            write_json(kept, laboratory.diagnose(case))
        out.append(read_json(kept))
        print(out[-1], flush=True)
    return out


def _key(config, settings, plan_file):
    """What decides every case beside the case: engine, code, settings, run spec, factors and
    emulator runs."""
    modules = sorted(Path(__file__).parents[1].rglob("*.py"))
    files = [path for path in modules if path.name not in SHOW]
    parts = [f.read_text() for f in [*files, Path(config.factors), Path(plan_file)]]
    parts += [engine_fingerprint(), json.dumps([settings.replicates, settings.alpha, config.run])]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _name(case, key):
    text = key + json.dumps(asdict(case))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


# as the workflow calls them


def discovery_plan(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """See `plan_runs`."""
    plan_runs(study.config, read_settings(source.settings), output)


def discovery_emulate(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """See `emulate`."""
    emulate(study.config, read_settings(source.settings), source, output)


def discovery_shard(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Diagnose the cases of one shard; the name of its table is its number."""
    settings, table = read_settings(source.settings), Path(output.table)
    kept = table.parents[1] / "kept"
    run_shard(study.config, settings, source, int(table.stem), SHARDS, kept, table)


def discovery_benchmark(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """See `merge`."""
    merge(source.tables, output)


def merge(tables: Iterable[str | Path], output: NamedFiles) -> None:
    """Write all cases, the confusion matrix, the rates, their page and the figure."""
    table = pd.concat([read_written(t, keep_default_na=False) for t in tables], ignore_index=True)
    table = table.sort_values(["case", "truth", "strength", "seed"])
    at = table[(table["case"] != "mechanism") | (table["strength"] == 1.0)]
    truth = np.where(at["truth"] == "", at["case"], at["case"] + ": " + at["truth"])
    write_table(table, output.cases)
    write_table(
        pd.crosstab(truth, at["outcome"].to_numpy()).rename_axis("hidden").reset_index(),
        output.confusion,
    )
    rates = summarise(table)
    write_table(rates, output.summary)
    write_text(page(table, rates), output.page)
    common.save(benchmark_figure(table, rates), output.figure)
