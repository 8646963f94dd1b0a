"""The benchmark of the diagnosis: hidden effects, nulls, decoys, pairs and unknown causes, all through the engine.

Every case simulates its data with the real engine (`hidden.draw`) and diagnoses them with the emulators; the truth is
looked at only when the verdict is there. Decoys and removed mechanisms use the data of other cases.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from calibration import figures as common
from calibration.discrepancy import figures, hidden
from calibration.discrepancy.catalogue import load_catalogue
from calibration.discrepancy.design import plan
from calibration.discrepancy.emulator import teach
from calibration.discrepancy.identify import identify
from calibration.discrepancy.model import Emulated
from calibration.discrepancy.runs import simulate
from calibration.discrepancy.settings import parameters_of
from dem.io.files import write_json

MECHANISMS = (
    "viscoelastic_restitution",
    "plastic_restitution",
    "air_drag",
    "apex_sampling",
    "under_resolved_contact",
    "tilt_detection_lag",
    "wall_adhesion",
    "stress_dependent_friction",
)
"""Mechanisms that show on drop and tilt, where a draw costs seconds."""

PAIRS = (
    ("viscoelastic_restitution", "tilt_detection_lag"),
    ("air_drag", "stress_dependent_friction"),
    ("plastic_restitution", "wall_adhesion"),
)
KINDS = ["drop", "tilt"]
NULLS, DRAWS = 40, 8
WEAKER = (0.25, 0.5)


@dataclass(frozen=True)
class Case:
    """One data set to diagnose."""

    case: str
    effects: tuple
    strength: float
    seed: int

    @property
    def truth(self):
        """Names of what is hidden."""
        return " + ".join(self.effects)


def cases(nulls=NULLS, draws=DRAWS):
    """All cases, the cheap re-uses after the data they re-use."""
    out = [Case("no effect", (), 0.0, s) for s in range(nulls)]
    out += [Case("mechanism", (m,), 1.0, 100 + s) for m in MECHANISMS for s in range(draws)]
    out += [Case("outlier", (), 0.0, s) for s in range(nulls)]
    out += [Case("understated", (), 0.0, s) for s in range(nulls)]
    out += [Case("removed", (m,), 1.0, 100 + s) for m in MECHANISMS for s in range(draws)]
    out += [Case("pair", p, 1.0, 200 + s) for p in PAIRS for s in range(draws // 2)]
    out += [
        Case("mechanism", (m,), w, 100 + s)
        for m in MECHANISMS
        for w in WEAKER
        for s in range(draws // 4)
    ]
    return out


def diagnose_case(case, emulated, base, factors_file, replicates=200, root="results/runs"):
    """A mapping: the case, the verdict, and whether the truth was named."""
    catalogue = load_catalogue()
    measured, _ = hidden.draw(
        case.seed,
        emulated.settings,
        base,
        factors_file,
        catalogue,
        dict.fromkeys(case.effects, case.strength),
        root=root,
    )
    if case.case == "outlier":
        measured = hidden.outlier(measured, case.seed)
    if case.case == "understated":
        measured = hidden.understated(measured)
    if case.case == "removed":
        known = load_catalogue(without=case.effects)
        emulated = Emulated(emulated.emulators, emulated.settings, emulated.factors, known)
    found = identify(emulated, measured, emulated.settings.alpha, replicates, case.seed)
    return judge(case, found)


def judge(case, found):
    """Compare a verdict with the truth."""
    first = found.ranking[0]["mechanism"]
    named = found.verdict in ("identified", "ambiguous")
    outcome = " + ".join(found.causes) if found.verdict == "identified" else found.verdict
    return {
        "case": case.case,
        "truth": case.truth,
        "strength": case.strength,
        "seed": case.seed,
        "verdict": found.verdict,
        "causes": " + ".join(found.causes),
        "first": first if named else "",
        "named_first": named and set(first.split(" + ")) == set(case.effects),
        "outcome": outcome,
        "lack_of_fit_p": found.lack_of_fit_p,
        "family_p": found.family_p,
        "gain": found.ranking[0]["gain"],
        "data": "real engine",
    }


def summarise(table):
    """Rates with their 95 % Wilson intervals: power by mechanism and strength, false alarms, decoys, pairs."""
    rows = []

    def add(name, hits):
        hits = np.asarray(hits, bool)
        low, high = _wilson(int(hits.sum()), len(hits))
        rows.append({"what": name, "share": hits.mean(), "low": low, "high": high, "n": len(hits)})

    of = {case: own for case, own in table.groupby("case")}
    if "no effect" in of:
        add("no effect: adequate", of["no effect"]["verdict"] == "adequate")
        add("no effect: identified", of["no effect"]["verdict"] == "identified")
    for case in ("outlier", "understated"):
        if case in of:
            add(f"{case}: identified", of[case]["verdict"] == "identified")
    if "mechanism" in of:
        full = of["mechanism"][of["mechanism"]["strength"] == 1.0]
        add("all mechanisms, strength 1: named first", full["named_first"])
        add("all mechanisms, strength 1: identified and right", full["outcome"] == full["truth"])
        wrong = (full["verdict"] == "identified") & (full["outcome"] != full["truth"])
        add("all mechanisms, strength 1: identified and wrong", wrong)
        for (name, strength), own in of["mechanism"].groupby(["truth", "strength"]):
            add(f"{name}, strength {strength:g}: named first", own["named_first"])
    if "removed" in of:
        add("outside the catalogue: identified", of["removed"]["verdict"] == "identified")
        for name, own in of["removed"].groupby("truth"):
            add(f"{name} outside the catalogue: identified", own["verdict"] == "identified")
    if "pair" in of:
        both = [
            set(t.split(" + ")) <= set(c.split(" + "))
            for t, c in zip(of["pair"]["truth"], of["pair"]["causes"], strict=True)
        ]
        add("pairs: both named", both)
    return pd.DataFrame(rows)


def _wilson(hits, n):
    """95 % Wilson interval of a share."""
    z = 1.959964
    centre = (hits + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * np.sqrt(hits * (n - hits) / n + z * z / 4)
    return centre - half, centre + half


def plan_runs(config, settings, output):
    """Write the design and plan of the emulators of drop and tilt."""
    factors = parameters_of(settings, config.factors, KINDS)
    rows, specs = plan(settings, config.run, factors, load_catalogue(), KINDS)
    write_json(output.design, rows)
    write_json(output.plan, specs)


def run_shard(config, settings, source, shard, shards, table):
    """Diagnose the cases whose seed falls to this shard; cases that share their data share a shard."""
    rows, specs = (json.loads(Path(f).read_text()) for f in (source.design, source.plan))
    factors = parameters_of(settings, config.factors, KINDS)
    emulators, _ = teach(rows, simulate(specs), settings, factors)
    emulated = Emulated(emulators, settings, factors, load_catalogue())
    out = []
    for case in cases():
        if case.seed % shards == shard:
            out.append(diagnose_case(case, emulated, config.run, config.factors))
            print(out[-1], flush=True)
    _write(pd.DataFrame(out), table)


def merge(tables, output):
    """Write all cases, the confusion matrix, the rates and the figure."""
    table = pd.concat([pd.read_csv(t, keep_default_na=False) for t in tables], ignore_index=True)
    table = table.sort_values(["case", "truth", "strength", "seed"])
    at = table[(table["case"] != "mechanism") | (table["strength"] == 1.0)]
    truth = np.where(at["truth"] == "", at["case"], at["case"] + ": " + at["truth"])
    _write(table, output.cases)
    _write(
        pd.crosstab(truth, at["outcome"].to_numpy()).rename_axis("hidden").reset_index(),
        output.confusion,
    )
    _write(summarise(table), output.summary)
    common.save(figures.benchmark_figure(table), output.figure)


def _write(table, path):
    partial = Path(path).with_name(f".{Path(path).name}.partial")
    table.to_csv(partial, index=False)
    partial.replace(path)
