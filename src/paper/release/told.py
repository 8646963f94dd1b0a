"""The numbers of docs/results.md, each computed from the kept results; `results.md.j2` has the
words."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.chain.screening import aliasing
from calibration.figures import label
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from calibration.statistics.screening import screen
from calibration.statistics.surface import fit_surface
from paper.audit import run_audit
from paper.rigs import KEYS, POINTS, RATES, READINGS, SPEEDS, chosen, judged

CODES = "ABCDEFG"
PACKED = 1250
"""Most grains in the funnel at once [-] above which a pour of the paper's rig has packed: the two
kinds of pours lie hundreds of grains apart on either side of it."""
SEEDS = {1: "salt", 2: "salt-2", 3: "salt-3", 4: "salt-4"}


def degrees(value: float, digits: int = 1) -> str:
    """'+18.1°', with a true minus."""
    return f"{value:+.{digits}f}°".replace("-", "−")


def funnels(kept: str | Path) -> dict[str, Any]:
    """What the packing of the funnel does to the angle."""
    table = read_written(Path(kept) / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna(subset=["angle_of_repose_deg", "hold_up"])
    angle, held = runs["angle_of_repose_deg"], runs["hold_up"]
    packed = held > PACKED
    steep, flat = angle[packed], angle[~packed]
    error = np.hypot(steep.std() / np.sqrt(len(steep)), flat.std() / np.sqrt(len(flat)))
    first = table.loc[table["stage"] == "candidate_first", "angle_of_repose_deg"]
    screened = table.loc[table["stage"] == "screening", "hold_up"].dropna().sort_values()
    return {
        "runs": len(runs),
        "packed": len(steep),
        "held_packed": f"{held[packed].min():,.0f} to {held[packed].max():,.0f}",
        "held_free": f"{held[~packed].min():,.0f} to {held[~packed].max():,.0f}",
        "steeper": f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°",
        "steep": f"{steep.mean():.1f}° ± {steep.std():.2f}°",
        "flat": f"{flat.mean():.1f}° ± {flat.std():.2f}°",
        "first": len(first),
        "first_sd": f"{first.std():.2f}°",
        "screened_most": f"{screened.iloc[-2]:,.0f} and {screened.iloc[-1]:,.0f}",
        "screened_rest": f"{screened.iloc[-3]:,.0f}",
        "lost": sorted(int(n) for n in _lost(kept)),
    }


def _lost(kept):
    """Numbers of the screening's runs without a value."""
    runs = read_written(Path(kept) / "screening" / "runs.csv")
    return runs.loc[runs["response"].isna(), "run"]


def printed_effects(paper: str | Path = "data/paper") -> dict[str, float]:
    """{code: effect [°]} of the paper's screening."""
    table = read_written(Path(paper) / "table06_plackett_burman.csv", comment="#")
    return {c: float((table["angle_deg"] * table[c]).mean() * 2.0) for c in CODES}


def screening(kept: str | Path) -> dict[str, Any]:
    """Effects of a study's screening beside the paper's."""
    table = read_written(Path(kept) / "screening" / "effects.csv").set_index("code")
    printed, effect = printed_effects(), table["effect"]
    off = np.sqrt(np.mean([(effect[c] - printed[c]) ** 2 for c in CODES]))
    return {
        "effect": {c: degrees(effect[c]) for c in CODES},
        "printed": {c: f"{printed[c]:+.2f}°".replace("-", "−") for c in CODES},
        "se": f"{table['se'].iloc[0]:.2f}°",
        "off": f"{off:.1f}°",
        "found": [c for c in CODES if table["p"][c] < 0.05],
    }


def validated(kept: str | Path) -> dict[str, str]:
    """The validation of a study."""
    v = read_json(Path(kept) / "validation" / "validation.json")
    low, high = (fixed(v[f"difference_{end}"], 2, "+") for end in ("low", "high"))
    return {
        "mean": f"{v['simulated_mean']:.2f}°",
        "sd": f"{v['simulated_sd']:.2f}°",
        "difference": f"{v['difference']:+.2f}° ({low} to {high})".replace("-", "−"),
        "verdict": ("" if v["equivalent"] else "not shown to be ") + "equivalent",
    }


def surface(kept: str | Path) -> dict[str, Any]:
    """Statistics of a response surface, and its oddest run."""
    kept = Path(kept) / "response_surface"
    s = read_json(kept / "response_surface.json")["statistics"]
    runs = read_written(kept / "runs.csv").dropna(subset="response")
    fitted = fit_surface(runs, [c for c in runs if len(c) == 1], runs["response"])
    odd = fitted.diagnostics["externally_studentised"].abs()
    return {
        "cv": f"{s['CV_percent']:.2f} %",
        "r2": f"{s['R2']:.3f}",
        "odd_run": int(runs["run"].iloc[int(odd.argmax())]),
        "odd": f"{odd.max():.1f}",
    }


def posterior(kept: str | Path) -> dict[str, Any]:
    """Intervals, correlations and what would narrow them."""
    kept = Path(kept) / "posterior"
    p = read_json(kept / "posterior.json")
    names = list(p["parameters"])
    rolling = "salt_salt_rolling_friction"
    interval = p["parameters"][rolling]["interval"]
    i = names.index(rolling)
    others = [
        f"{label(n)} ({fixed(p['correlation'][i][k], 2, '+')})"
        for k, n in enumerate(names)
        if k != i and abs(p["correlation"][i][k]) >= 0.3
    ]
    following = read_written(kept / "next.csv").set_index("metric")
    left = {
        m: {n: f"{100 * following.loc[m, f'{n} left']:.0f} %" for n in names}
        for m in ("hold_up", "on_plate", "height_mm", "angle_of_repose_deg")
        if m in following.index
    }
    return {
        "trained_by": p["trained_by"],
        "rolling": f"{interval[0]:.3f} to {interval[1]:.3f}",
        "free": [label(n) for n in names if not p["parameters"][n]["bounded"]],
        "sobol": f"{100 * p['sobol'][rolling]['total']:.0f} %" if rolling in p["sobol"] else "",
        "correlated": others,
        "left": left,
        "names": {n: label(n) for n in names},
    }


def other_seeds(results: str | Path) -> dict[str, Any]:
    """The screening at each of SEEDS, and all of them together."""
    rows, runs = [], []
    for seed, name in SEEDS.items():
        folder = Path(results) / name / "screening"
        here, effects = (read_written(folder / f) for f in ("runs.csv", "effects.csv"))
        runs.append(here)
        lost = ", ".join(str(k) for k in here.loc[here["response"].isna(), "run"]) or "none"
        big = effects[effects["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
        found = ", ".join(
            f"{label(n)} {degrees(e)}" for n, e in zip(big["name"], big["effect"], strict=True)
        )
        rows.append({"seed": seed, "lost": lost, "found": found or "none"})
    together = pd.concat(runs).dropna(subset="response")
    screened = screen(together, list(CODES), together["response"])
    lack = aliasing(together, list(CODES))["lack_of_fit"]
    anova, table = screened.anova.set_index("source"), screened.table.set_index("code")
    there = table[table["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
    lost = pd.concat(runs).set_index("run")["response"].isna().groupby("run").sum()
    return {
        "rows": rows,
        "heaps": len(together),
        "sd": f"{screened.seed_sd:.2f}°",
        "freedom": f"{anova.loc['Pure Error', 'df']:.0f}",
        "lack": f"{lack['sd']:.1f}°",
        "lack_freedom": f"{anova.loc['Lack of Fit', 'df']:.0f}",
        "lack_test": f"F = {lack['F']:.0f}, p = {lack['p']:.0e}".replace("e-0", "e-"),
        "lack_pairs": lack["largest"],
        "lack_share": f"{lack['share']:.0%}".replace("%", " %"),
        "found": [
            f"{c} {degrees(e)} ± {s:.1f}°"
            for c, e, s in zip(there.index, there["effect"], there["se"], strict=True)
        ],
        "lost": [f"run {k} clogged in {n} of {len(SEEDS)}" for k, n in lost.items() if n],
    }


def speeds(history: str | Path = "benchmarks/history.csv") -> dict[str, Any]:
    """Million particle-steps per second of the last comparison with other engines, and of which
    engine it was."""
    table = read_written(Path(history))
    last = table.groupby("case").last()
    of = last["particle_steps_per_s"]
    rate = {
        name: of[f"peers: {name}"] / 1e6 for name in ("this engine", "liggghts", "lammps", "yade")
    }
    return {
        "rate": {n: f"{r:.3g}" for n, r in rate.items()},
        "times": f"{rate['this engine'] / rate['liggghts']:.1f}",
        "engine": str(last.loc["peers: this engine", "engine"]),
        "date": str(last.loc["peers: this engine", "date"]),
        "machine": str(last.loc["peers: this engine", "machine"]),
        "heap": f"{of['funnel heap'] / of['settled bed']:.2f}",
    }


def audited(paper: str | Path = "data/paper") -> int:
    """Number of printed figures and statements that the audit judges."""
    return len(run_audit(Path(paper)))


def locus(kept: str | Path) -> str:
    """Slope of the yield locus at the friction in use, with its 95 % interval."""
    shear = read_json(Path(kept) / "shear" / "shear.json")
    low, high = shear["peak"]["slope_interval"]
    slope, friction = shear["peak"]["slope"], shear["peak"]["particle_friction"]
    return f"{slope:.2f} ({low:.2f} to {high:.2f}, 95 %) at a friction of {friction:g}"


def scaling(kept: str | Path) -> list[str]:
    """Change of the angle without cohesion by the paper's rule, in a rig that is doubled and in one
    that is enlarged fourfold."""
    table = read_written(Path(kept) / "reproduction" / "reproduction.csv").set_index("id")
    rows = (table.loc[f"heap.paper.plain{end}"] for end in (".twice", ""))
    cells = ((fixed(row[k], 1) for k in ("difference", "low", "high")) for row in rows)
    return ["{}° ({} to {})".format(*values) for values in cells]


def slow_pour(kept: str | Path) -> dict[str, dict[str, Any]]:
    """{table: (what the slower pour leaves [°], its chance by the rig's own scatter, whether that
    explains it)} of the paper's tables of heaps."""
    found = read_json(Path(kept) / "disagreement" / "disagreement.json")
    out = {}
    for name in ("Table 6", "Table 10", "Table 11"):
        (one,) = (r for r in found[name]["ranking"] if r["cause"] == SLOW)
        chance = f"{one['p_left']:.1g}".replace("e-0", "e-")
        out[name] = {
            "before": f"{found[name]['scatter_before']:.1f}°",
            "left": f"{one['scatter_after']:.1f}°",
            "scatter": f"{one['spread']:.2f}°",
            "p": chance,
            "explained": one["p_left"] >= 0.05,
        }
    return out


def rigs(kept: str | Path) -> dict[str, Any]:
    """What the runs of `paper.rigs` say of the rate of the pour and the speed that is not
    printed, by the rule that was stated before them."""
    table = read_written(Path(kept) / "runs.csv")
    found = judged(table)
    means = table[table["point"] == "candidate"].groupby(KEYS[1:])[READINGS[0]].mean()
    by_rig = found.set_index(["rate", "speed"])
    names = [f"{rate:,} a second at {speed} m/s" for rate, speed in by_rig.index]
    mixed = by_rig.index[~by_rig["one_kind"]]
    choice = chosen(found)
    return {
        "runs": len(table),
        "planned": len(list(RATES)) * len(SPEEDS) * sum(seeds for _, seeds in POINTS.values()),
        "mean": {rate: [f"{means[rate, s]:.1f}°" for s in SPEEDS] for rate in RATES},
        "moves": {r: [f"{by_rig.loc[(r, s), 'moves']:.1f}°" for s in SPEEDS[:-1]] for r in RATES},
        "well_posed": [n for n, good in zip(names, found["well_posed"], strict=True) if good],
        "two_kinds": [
            f"{rate:,} a second at {speed} m/s ({by_rig.loc[(rate, speed), 'least']:,} to "
            f"{by_rig.loc[(rate, speed), 'most']:,} grains in the funnel)"
            for rate, speed in mixed
        ],
        "chosen": f"{choice[0]:,} a second at {choice[1]} m/s",
        "chosen_moves": f"{by_rig.loc[choice, 'moves']:.1f}°",
    }


SLOW = "pour of 6500 grains a second"


def table_13(paper: str | Path = "data/paper") -> dict[str, Any]:
    """Both readings of Table 13's 25 angles, and the standard errors that follow: of a screening
    effect and of the validated mean."""
    table = read_written(Path(paper) / "table13_validation.csv", comment="#")
    means = table.groupby("group")["angle_deg"].mean()
    runs, five = float(table["angle_deg"].std()), float(means.std())
    return {
        "runs": f"{runs:.3f}°",
        "means": f"{five:.2f}°",
        "freedom": len(means) - 1,
        "effect": [f"{2 * s / np.sqrt(12):.2f}°" for s in (five, runs)],
        "mean": [f"{five / np.sqrt(len(means)):.2f}°", f"{runs / np.sqrt(len(table)):.2f}°"],
    }
