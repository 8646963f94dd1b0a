"""Bulk tables of strangers: heaps, silos and shear cells in closed form, diagnosed as a user's
table is, with a budget of runs.

The engine's runs are the closed forms too, with a scatter from seed to seed and what small rigs
have: readings that do not follow the size of the grains smoothly. So every stage runs as it does in
a study, and a case takes seconds. The engine itself is asked in `engine_tables.py`.

Nature is the closed form at coefficients of its own, within the table of factors, with an effect or
without one. The seeds from 640 on are for this campaign alone: no rule was chosen by looking at
them.
"""

import json
import tempfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import chdir
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from benchmarks.rates.foreign_studies import FACTORS, FIXED, MATERIALS
from benchmarks.rates.kept_rates import KEPT, Trial, counted, f1_score, shares
from calibration.intake.quantities import LEVERS, QUANTITIES, measurable
from calibration.study.config.parse import parse_config
from diagnosis import stages
from diagnosis.declared import WAVES
from diagnosis.page.words import WITHOUT
from diagnosis.settings import study_settings
from diagnosis.setup import Setup

SEEDS = range(640, 660)
FACTOR_ROWS: list[Any] = [*pd.read_csv(StringIO(FACTORS), sep="\t").itertuples()]
G, DENSITY = 9.81, MATERIALS["materials"]["particle"]["density_kg_m3"]
RIGS: dict[str, dict[str, Any]] = {
    "heap": {
        "particles": {"count": 400, "diameter_mm": 5.8},
        "geometry": {"orifice_diameter_mm": 32, "discharge_height_mm": 40},
    },
    "discharge": {
        "particles": {"count": 2600, "diameter_mm": 2.0},
        "geometry": {"silo_diameter_mm": 32.5, "orifice_diameter_mm": 12.0},
    },
    "shear": {
        "particles": {"count": 2000, "diameter_mm": 2.0},
        "geometry": {"normal_stress_kPa": 2.0},
    },
}
LEVELS = {
    "heap": ("particle_diameter_mm", (3.6, 4.2, 5.0, 5.8, 6.4)),
    "discharge": ("orifice_diameter_mm", (10.4, 10.9, 11.4, 11.9, 12.4, 12.9)),
    "shear": ("normal_stress_kPa", (0.4, 0.8, 1.5, 3.0, 6.0)),
}
REPLICATES = 5
SCATTER = {"heap": 1.5, "discharge": 0.04, "shear": 0.02}
"""From seed to seed: degrees, else a share."""

READING = {"heap": 0.4, "discharge": 0.01, "shear": 0.01}
"""Of the laboratory, in the same."""

ROUGH = 1.0
"""Amplitude [deg] of what a heap's angle does between two sizes that lie near each other."""


# --- closed forms -------------------------------------------------------------------------------


@dataclass(frozen=True)
class State:
    """What a test depends on: coefficients, diameter d [mm], the lever's value, the attraction
    [N/m] that times pi d is the pull of two grains, and what the other mechanisms change."""

    rolling: float
    friction: float
    wall_friction: float
    d: float
    lever: float
    attraction: float = 0.0
    longer: float = 1.0
    stiffer: float = 1.0


def bond(s: State) -> float:
    """Pull over weight of a grain."""
    size = 1e-3 * s.d
    return np.pi * s.attraction * size / (DENSITY * G * np.pi / 6.0 * size**3)


def heap(s: State) -> float:
    """Angle [deg] of a heap: friction lifts it to a limit, and so does the pull over the weight;
    few large grains stand flatter."""
    loose = 8.0 + 20.0 * (1.0 - np.exp(-6.0 * s.rolling)) + 12.0 * s.friction / (s.friction + 0.5)
    loose += 5.0 * s.wall_friction - 1.5 * (s.d - 5.0)
    loose += ROUGH * np.sin(2.0 * np.pi * s.d / 0.9)
    sticky = 25.0 * bond(s) / (bond(s) + 0.6)
    return loose + sticky + 18.0 * (s.longer - 1.0) + 2.0 * np.log(s.stiffer)


def discharge(s: State) -> float:
    """Mass flow [g/s] of a silo (Beverloo, Leniger, van de Velde 1961, Chem. Eng. Sci. 15:260); a
    pull makes the orifice narrower, as larger grains do."""
    rate = 0.58 * (1.15 - 0.25 * s.friction - 0.2 * s.rolling - 0.1 * s.wall_friction)
    open_mm = s.lever - 1.4 * s.d * (1.0 + 0.15 * bond(s))
    flow = rate * 0.6 * DENSITY * np.sqrt(G) * max(1e-3 * open_mm, 1e-3) ** 2.5
    return 1e3 * flow * s.stiffer**-0.05


def shear(s: State) -> float:
    """Shear stress [kPa]: a friction times the load and the tensile strength of the grains, their
    pull over the square of their diameter times the share of solids over that of pores, 1.5 (Rumpf
    1962, in Agglomeration, Wiley)."""
    slope = 0.15 + 0.6 * s.friction + 0.5 * s.rolling + 0.02 * np.log(s.stiffer)
    tensile = 1.5 * np.pi * s.attraction / (1e-3 * s.d)
    return slope * (s.lever + 1e-3 * tensile)


FORMS: Mapping[str, Callable[[State], float]] = {
    "heap": heap, "discharge": discharge, "shear": shear,
}  # fmt: skip


def clogs(kind: str, s: State) -> bool:
    """Return whether grains arch over the orifice of a silo: fewer than five of them pass abreast,
    or a few more where they attract each other."""
    return kind == "discharge" and s.lever < 5.0 * s.d * (1.0 + 0.03 * bond(s))


def state_of(spec: Mapping[str, Any]) -> State:
    """`State` of a run spec."""
    kind, more = spec["experiment"], spec.get("law_parameters", {})
    grains, contacts = spec["particles"], spec["contacts"]
    place = LEVERS[LEVELS[kind][0]].place
    assert place is not None  # each of LEVELS is a key of a run spec
    part, key = place
    law = spec.get("laws", {}).get("cohesion")
    pull = {
        "jkr": 0.75 * more.get("surface_energy_J_m2", 0.0),
        "liquid_bridge": more.get("surface_tension_N_m", 0.0),
    }.get(law, 0.0)
    size = grains["diameter_mm"] * grains.get("scale_factor", 1.0)
    return State(
        contacts["particle_particle"]["rolling_friction"],
        contacts["particle_particle"]["static_friction"],
        contacts["particle_wall"]["static_friction"],
        size, size if key == "diameter_mm" else spec[part][key], pull,
        grains.get("elongation", 1.0), more.get("rolling_stiffness_factor", 1.0),
    )  # fmt: skip


def scattered(kind: str, value: float, sd: float, rng: np.random.Generator) -> float:
    """A reading with an error of sd, degrees or a share."""
    error = sd * rng.standard_normal()
    return value * (1.0 + error) if QUANTITIES[kind].relative else value + error


def simulated(seed: int, specs: Mapping[str, dict]) -> dict[str, dict[str, float] | None]:
    """Return what `calibration.runs.simulated.simulate` gives of the runs. seed: of the case, for
    each study has runs of its own, and with them errors of its emulators."""
    out: dict[str, dict[str, float] | None] = {}
    for name, spec in specs.items():
        kind, state = spec["experiment"], state_of(spec)
        rng = np.random.default_rng([seed, spec["seed"], zlib.crc32(repr(state).encode())])
        value = scattered(kind, FORMS[kind](state), SCATTER[kind], rng)
        key = measurable(kind)[QUANTITIES[kind].name].key
        out[name] = None if clogs(kind, state) else {key: max(value, 1e-3)}
    return out


# --- cases --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A table: its kind, and what it has; runs: the budget."""

    kind: str
    effect: str
    seed: int
    runs: int = 80

    @property
    def name(self) -> str:
        return f"{self.kind}, {self.effect}, {self.runs} runs#{self.seed}"


EFFECTS = {
    "nothing": ("heap", "discharge", "shear"),
    "attraction": ("heap", "discharge", "shear"),
    "one level off": ("heap", "shear"),
    "friction over the size": ("heap",),
}
RIGHT = {
    "attraction": {"heap": {"attraction"}, "discharge": {"attraction"},
                   "shear": {"attraction", "load"}},
    "friction over the size": {"heap": {"rolling_friction"}},
}  # fmt: skip
"""Slots of the law that is right. Over the load alone an attraction is the same formula as a load
that was not counted."""

NAMES = {"attraction": {"cohesion", "liquid_bridge"}}
PULL = {"heap": 0.02, "discharge": 0.03, "shear": 0.04}
"""Attraction [N/m], within the range of the catalogue."""


def campaign() -> list[Case]:
    """All cases, seed after seed, so that a part of them is a fair one."""
    return [
        Case(kind, effect, seed, runs)
        for seed in SEEDS
        for effect, kinds in EFFECTS.items()
        for kind in kinds
        for runs in ((60, 80) if effect == "nothing" else (80,))
    ]


def coefficients_of(rng: np.random.Generator) -> dict[str, float]:
    """Nature's coefficients, in the middle of their ranges."""
    return {r.name: r.low + (r.high - r.low) * rng.uniform(0.2, 0.8) for r in FACTOR_ROWS}


def random_of(case: Case) -> np.random.Generator:
    """Random numbers of a table, the coefficients first."""
    return np.random.default_rng([case.seed, *f"{case.kind}, {case.effect}".encode()])


def table_of(case: Case) -> pd.DataFrame:
    """The stranger's table: each reading is a row."""
    rng = random_of(case)
    lever, levels = LEVELS[case.kind]
    own = coefficients_of(rng)
    pull = PULL[case.kind] * (case.effect == "attraction")
    wrong = rng.integers(1, len(levels) - 1)
    quantity, rows = QUANTITIES[case.kind], []
    for k, level in enumerate(levels):
        d = level if case.kind == "heap" else RIGS[case.kind]["particles"]["diameter_mm"]
        along = np.log(level / levels[0]) / np.log(levels[-1] / levels[0]) - 0.5
        falls = -0.25 * along * (case.effect == "friction over the size")
        at = own | {"rolling": max(own["rolling"] + falls, 0.01)}
        state = State(**at, d=d, lever=level, attraction=pull)
        true = FORMS[case.kind](state)
        sd = float(np.hypot(SCATTER[case.kind], READING[case.kind]))
        if case.effect == "one level off" and k == wrong:
            off = 12.0 * sd / np.sqrt(REPLICATES)
            true = true * (1.0 + off) if quantity.relative else true + off
        row = {"experiment": case.kind, "quantity": quantity.name, "unit": quantity.unit}
        if clogs(case.kind, state):
            rows.append(row | {lever: level, "outcome": "clogged", "n": REPLICATES, "sd": ""})
            continue
        readings = (scattered(case.kind, true, sd, rng) for _ in range(REPLICATES))
        rows += [row | {"value": f"{value:.4g}", lever: level} for value in readings]
    return pd.DataFrame(rows)


# --- the diagnosis ------------------------------------------------------------------------------


def diagnosed(table: pd.DataFrame, kind: str, runs: int, seed: int = 0) -> dict[str, Any]:
    """verdict.json of a table, by the stages of the diagnosis in a folder of their own, with closed
    forms for runs; the runs that were made under `made`. seed: of the runs' scatter."""
    figures: Any = SimpleNamespace(save=lambda figure, _: plt.close(figure))

    def simulate(specs, *_):
        return simulated(seed, specs)

    with (
        tempfile.TemporaryDirectory() as folder,
        chdir(folder),
        patch.multiple(stages, simulate=simulate, common=figures),
        patch.multiple("diagnosis.setup", simulate=simulate, untested=lambda names: set()),
    ):
        table.to_csv("table.csv", index=False)
        Path("factors.tsv").write_text(FACTORS)
        config = parse_config({
            "name": "stranger", "factors": "factors.tsv", "measurements": "table.csv",
            "tests": {"test": {"experiment": kind, "run": MATERIALS | RIGS[kind]}},
            "fixed": FIXED,
            "diagnosis": {"runs": runs},
        })  # fmt: skip
        study: Any = SimpleNamespace(config=config)
        return _stages(Setup(study, study_settings(config)))


def _stages(setup):
    files = SimpleNamespace(design="design.json", plan="plan.json")
    stages.plan_runs(setup, files)
    files.designs, files.plans, files.left = [files.design], [files.plan], []
    for wave in range(1, WAVES + 1):
        own = SimpleNamespace(**{n: f"{n}_{wave}.json" for n in ("design", "plan", "left")})
        stages.plan_refinement(setup, files, own, wave)
        files.designs.append(own.design)
        files.plans.append(own.plan)
        files.left.append(own.left)
    last = SimpleNamespace(
        findings="findings.json", extension="extension.json", plan="last.json", gain="g.svg",
        verdict="verdict.json", page="page.md", alone="page.html", predictions="", ranking="",
    )  # fmt: skip
    stages.name_causes(setup, files, last)
    stages.conclude(setup, last, last)
    plans = ("plan.json", *(f"plan_{w}.json" for w in range(1, WAVES + 1)), "last.json")
    made = {run for file in plans for run in json.loads(Path(file).read_text())}
    return json.loads(Path("verdict.json").read_text()) | {"made": len(made)}


# --- marks and rates ----------------------------------------------------------------------------


def off_truth(case: Case, found: Mapping[str, Any] | None) -> dict[str, Any]:
    """{off, held}: mean distance of calibrated coefficients from nature's, in ranges of their
    factors, and how many of their 95 % intervals hold it; None without a calibration."""
    if not found:
        return {"off": None, "held": None}
    own = coefficients_of(random_of(case))
    off = [abs(found[r.name]["value"] - own[r.name]) / (r.high - r.low) for r in FACTOR_ROWS]
    held = [found[n]["low"] <= value <= found[n]["high"] for n, value in own.items()]
    return {"off": round(float(np.mean(off)), 4), "held": sum(held)}


def judged(case: Case) -> dict[str, Any]:
    """The row of a case."""
    said = diagnosed(table_of(case), case.kind, case.runs, case.seed)
    laws = said.get("laws") or []
    names = sorted({n for law in laws for n in law["names"]})
    claims = said["verdict"] in ("identified", "discovered")
    gain = said.get("gain") or {}
    ends = gain.get("held_out_rmse_difference_interval")
    right, place = NAMES.get(case.effect, set()), RIGHT.get(case.effect, {}).get(case.kind, set())
    parts = {"base": said["calibration"], "extended": said.get("calibration_extended")}
    found = {part: off_truth(case, own) for part, own in parts.items()}
    return {
        "case": case.name, "kind": case.kind, "effect": case.effect, "runs": case.runs,
        "seed": case.seed, "verdict": said["verdict"],
        "laws": "; ".join(f"{law['slot']}({' '.join(law['state'])})" for law in laws),
        "names": "; ".join(names), "rows": len(said.get("rows") or []),
        "claimed": int(claims),
        "leads": int(any(law["slot"] in place for law in laws[:1])),
        "hits": sum(law["slot"] in place for law in laws), "placed": len(laws),
        "wrong_name": int(claims and bool(set(names) - right)),
        "p": round(said["lack_of_fit"]["p"], 4), "family_p": round(said["family_p"], 4),
        "gain": "" if ends is None else f"{ends[0]:.2f} to {ends[1]:.2f}",
        "loses": int(claims and bool(names) and ends is not None and ends[1] < 0.0),
        "over_budget": int(said["made"] > case.runs), "made": said["made"],
        **{f"{k}_{part}": v for part, own in found.items() for k, v in own.items()},
        "reason": said["reason"][:160],
    }  # fmt: skip


def told(rows: pd.DataFrame) -> list[str]:
    """Return lines of Markdown: the rates."""
    null, off = rows[rows["effect"] == "nothing"], rows[rows["effect"] == "one level off"]
    out: list[tuple[str, Iterable[int]]] = []
    for kind in EFFECTS["nothing"]:
        for runs, own in null[null["kind"] == kind].groupby("runs"):
            out.append((f"{kind}, nothing, {runs} runs: `adequate`", own["verdict"] == "adequate"))
    out.append(("nothing: `adequate`", null["verdict"] == "adequate"))
    claimed = null["verdict"].isin(["identified", "discovered", "ambiguous"])
    out.append(("nothing: no law, `ambiguous` counted as one", ~claimed))
    for effect, kinds in EFFECTS.items():
        for kind in kinds if effect in RIGHT else ():
            own = rows[(rows["effect"] == effect) & (rows["kind"] == kind)]
            wrong = ~own["verdict"].isin(WITHOUT)
            out.append((f"{kind}, {effect}: its place leads", own["leads"]))
            out.append((f"{kind}, {effect}: something is said to be wrong", wrong))
    hidden = rows[rows["effect"].isin(list(RIGHT))]
    sure = (hidden["claimed"] == 1) & (hidden["leads"] == 1) & (hidden["wrong_name"] == 0)
    out += [
        ("a law: its place leads", hidden["leads"]),
        ("a law: something is said to be wrong", ~hidden["verdict"].isin(WITHOUT)),
        ("a law: its place without a doubt, and no wrong name", sure),
        ("one level off: no law", ~off["claimed"].astype(bool)),
        ("one level off: the row is pointed at", off["rows"] > 0),
        ("a wrong name", rows["wrong_name"]),
        ("a name with a gain below zero", rows["loses"]),
        ("more runs than the budget", rows["over_budget"]),
    ]
    pull = hidden[(hidden["effect"] == "attraction") & hidden["off_extended"].notna()]
    pull = pull.assign(coefficients=len(FACTOR_ROWS))
    for part, words in (("base", "without"), ("extended", "with")):
        hits = counted(pull, f"held_{part}", "coefficients")
        out.append((f"attraction: nature's coefficient in its 95 % {words} the extension", hits))
    off = [pull[f"off_{part}"].mean() for part in ("base", "extended")]
    f1 = f1_score(int(hidden["hits"].clip(upper=1).sum()), len(hidden), int(rows["placed"].sum()))
    return [
        *shares(out),
        f"| F1 of the places | {f1:.2f} |",
        "| attraction: coefficients off nature's, in their ranges | "
        f"{off[0]:.3f} without, {off[1]:.3f} with the extension |",
    ]


TRIAL = Trial(
    "bulk tables", KEPT / "bulk_tables.csv", "bulk", campaign,
    lambda case: {"case": case.name}, judged, told,
)  # fmt: skip
