"""Bulk tables of strangers: heaps, silos and shear cells in closed form, diagnosed as a user's
table is, with a budget of runs.

The engine's runs are the closed forms too, with a scatter from seed to seed and what small rigs
have: readings that do not follow the size of the grains smoothly. So every stage runs as it does in
a study, and a case takes seconds. The engine itself is asked in `engine_tables.py`.

Nature is the closed form at coefficients of its own, within the table of factors, with an effect or
without one. The seeds from 640 on are for this campaign alone: no rule was chosen by looking at
them.
"""

import tempfile
import zlib
from collections.abc import Mapping
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
import yaml

from benchmarks.rates.foreign_studies import FACTORS, FIXED, MATERIALS
from benchmarks.rates.kept_rates import CLAIMS, WORDS, Trial, f1_score, figures
from calibration.files import read_json
from calibration.intake.quantities import LEVERS, QUANTITIES, measurable
from calibration.study.config import numbers_of, parse_config
from diagnosis import stages
from diagnosis.declared import WAVES
from diagnosis.settings import study_settings
from diagnosis.setup import Setup

SEEDS = range(640, 660)
FACTOR_ROWS: list[Any] = [*pd.read_csv(StringIO(FACTORS), sep="\t").itertuples()]
G, DENSITY = 9.81, MATERIALS["materials"]["particle"]["density_kg_m3"]
REPLICATES = 5


GIVEN = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text())
TESTS = {kind: SimpleNamespace(**own) for kind, own in GIVEN["tests"].items()}
EFFECTS: dict[str, dict[str, Any]] = GIVEN["effects"]
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


FORMS = {form.__name__: form for form in (heap, discharge, shear)}


def clogs(kind: str, s: State) -> bool:
    """Return whether grains arch over the orifice of a silo: fewer than five of them pass abreast,
    or a few more where they attract each other."""
    return kind == "discharge" and s.lever < 5.0 * s.d * (1.0 + 0.03 * bond(s))


def state_of(spec: Mapping[str, Any]) -> State:
    """`State` of a run spec."""
    at = numbers_of(spec)
    at["particles.diameter_mm"] *= at.get("particles.scale_factor", 1.0)
    place = LEVERS[TESTS[spec["experiment"]].lever].place
    assert place is not None  # each is a key of a run spec
    pulls = {
        "jkr": 0.75 * at.get("law_parameters.surface_energy_J_m2", 0.0),
        "liquid_bridge": at.get("law_parameters.surface_tension_N_m", 0.0),
    }
    return State(
        **{r.name: at[r.key] for r in FACTOR_ROWS},
        d=at["particles.diameter_mm"],
        lever=at[".".join(place)],
        attraction=pulls.get(spec.get("laws", {}).get("cohesion"), 0.0),
        longer=at.get("particles.elongation", 1.0),
        stiffer=at.get("law_parameters.rolling_stiffness_factor", 1.0),
    )


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
        value = scattered(kind, FORMS[kind](state), TESTS[kind].scatter, rng)
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


def campaign() -> list[Case]:
    """All cases, seed after seed, so that a part of them is a fair one."""
    return [
        Case(kind, effect, seed, runs)
        for seed in SEEDS
        for effect, own in EFFECTS.items()
        for kind in own["right"]
        for runs in own["runs"]
    ]


def nature_of(case: Case) -> tuple[dict[str, float], np.random.Generator]:
    """Nature's coefficients, in the middle of their ranges, and the random numbers after them."""
    rng = np.random.default_rng([case.seed, *f"{case.kind}, {case.effect}".encode()])
    own = {r.name: r.low + (r.high - r.low) * rng.uniform(0.2, 0.8) for r in FACTOR_ROWS}
    return own, rng


def table_of(case: Case) -> pd.DataFrame:
    """The stranger's table: each reading is a row."""
    own, rng = nature_of(case)
    test = TESTS[case.kind]
    lever, levels = test.lever, test.levels
    sd = float(np.hypot(test.scatter, test.reading))
    pull = test.pull * (case.effect == "attraction")
    wrong = rng.integers(1, len(levels) - 1)
    quantity, rows = QUANTITIES[case.kind], []
    for k, level in enumerate(levels):
        d = level if case.kind == "heap" else test.run["particles"]["diameter_mm"]
        along = np.log(level / levels[0]) / np.log(levels[-1] / levels[0]) - 0.5
        falls = -0.25 * along * (case.effect == "friction over the size")
        at = own | {"rolling": max(own["rolling"] + falls, 0.01)}
        state = State(**at, d=d, lever=level, attraction=pull)
        true = FORMS[case.kind](state)
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


def diagnosed(case: Case) -> dict[str, Any]:
    """verdict.json of the table of a case, by the stages of the diagnosis in a folder of their own,
    with closed forms for runs; the runs that were made under `made`."""
    figures: Any = SimpleNamespace(save=lambda figure, _: plt.close(figure))

    def simulate(specs, *_):
        return simulated(case.seed, specs)

    with (
        tempfile.TemporaryDirectory() as folder,
        chdir(folder),
        patch.multiple(stages, simulate=simulate, common=figures),
        patch.multiple("diagnosis.setup", simulate=simulate, untested=lambda names: set()),
    ):
        table_of(case).to_csv("table.csv", index=False)
        Path("factors.tsv").write_text(FACTORS)
        run = MATERIALS | TESTS[case.kind].run
        config = parse_config({
            "name": "stranger", "factors": "factors.tsv", "measurements": "table.csv",
            "tests": {"test": {"experiment": case.kind, "run": run}},
            "fixed": FIXED,
            "diagnosis": {"runs": case.runs},
        })  # fmt: skip
        study: Any = SimpleNamespace(config=config)
        return _stages(Setup(study, study_settings(config)))


def _stages(setup):
    files = SimpleNamespace(designs=[], plans=[], left=[])
    for wave in range(WAVES + 1):
        own = SimpleNamespace(**{n: f"{n}_{wave}.json" for n in ("design", "plan", "left")})
        if wave:
            stages.plan_refinement(setup, files, own)
            files.left.append(own.left)
        else:
            stages.plan_runs(setup, own)
        files.designs.append(own.design)
        files.plans.append(own.plan)
    last = SimpleNamespace(
        findings="findings.json", extension="extension.json", plan="last.json", gain="g.svg",
        verdict="verdict.json", page="page.md", alone="page.html", predictions="", ranking="",
        table="residuals.csv", residuals="",
    )  # fmt: skip
    stages.name_causes(setup, files, last)
    stages.conclude(setup, last, last)
    made = {run for plan in (*files.plans, last.plan) for run in read_json(plan)}
    return read_json("verdict.json") | {"made": len(made)}


# --- marks and rates ----------------------------------------------------------------------------


def off_truth(case: Case, found: Mapping[str, Any] | None) -> dict[str, Any]:
    """{off, held}: mean distance of calibrated coefficients from nature's, in ranges of their
    factors, and how many of their 95 % intervals hold it; None without a calibration."""
    if not found:
        return {"off": None, "held": None}
    own, _ = nature_of(case)
    off = [abs(found[r.name]["value"] - own[r.name]) / (r.high - r.low) for r in FACTOR_ROWS]
    held = [found[n]["low"] <= value <= found[n]["high"] for n, value in own.items()]
    return {"off": round(float(np.mean(off)), 4), "held": sum(held)}


def judged(case: Case) -> dict[str, Any]:
    """The row of a case."""
    said = diagnosed(case)
    laws = said.get("laws") or []
    names = sorted({n for law in laws for n in law["names"]})
    claims = said["verdict"] in CLAIMS
    gain = said.get("gain") or {}
    ends = gain.get("held_out_rmse_difference_interval")
    effect = EFFECTS[case.effect]
    right, place = set(effect["names"]), effect["right"][case.kind]
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


def told(rows: pd.DataFrame) -> str:
    """Return Markdown: the rates."""
    laws = [effect for effect, own in EFFECTS.items() if any(own["right"].values())]
    hidden = rows[rows["effect"].isin(laws)]
    pull = hidden[(hidden["effect"] == "attraction") & hidden["off_extended"].notna()]
    off = {part: pull[f"off_{part}"].mean() for part in ("base", "extended")}
    f1 = f1_score(int(hidden["hits"].clip(upper=1).sum()), len(hidden), int(rows["placed"].sum()))
    asked = figures("bulk_tables", rows.assign(coefficients=len(FACTOR_ROWS)))
    return WORDS.bulk_tables(asked, f1, off)


TRIAL = Trial("bulk_tables", "bulk", campaign, judged, told)
