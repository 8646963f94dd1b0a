"""The numbers of docs/results.md, each computed from the kept results; `results.md.j2` has the
words."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration import Study
from calibration.chain import validation
from calibration.chain.screening import aliasing
from calibration.figures import label
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from calibration.statistics.screening import screen
from calibration.statistics.surface import fit_surface, outlier_limit
from dem.spec import Numerics
from paper.audit import run_audit
from paper.reference import TABLE
from paper.reproduction.screening import own_half
from paper.rigs import ALLOWED, KEYS, POINTS, RATES, READINGS, SPEEDS, chosen, judged

CODES = "ABCDEFG"
MILLION = "bed of 1000000 on two threads"
AT_REST = re.compile(r"grains at rest, (?P<radii>\S+) radii in (?P<ms>\S+) ms")
"""Cases of the history of speeds."""
RESTING = Numerics.model_fields["rest_energy_ratio"].default
"""Energy of motion at which a million grains are at rest, as a heap's are."""
PACKED = 1250
"""Most grains in the funnel at once [-] above which a pour of the paper's rig has packed: the two
kinds of pours lie hundreds of grains apart on either side of it."""
SEEDS = {1: "salt", 2: "salt-2", 3: "salt-3", 4: "salt-4"}


def degrees(value: float, digits: int = 1) -> str:
    """'+18.1°', with a true minus."""
    return f"{value:+.{digits}f}°".replace("-", "−")


def funnels(kept: str | Path) -> dict[str, Any]:
    """What stood in the funnel at once, and what its packing does to the angle where some runs
    packed and others did not (`two_kinds`)."""
    table = read_written(Path(kept) / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna(subset=["angle_of_repose_deg", "hold_up"])
    first = table.loc[table["stage"] == "candidate_first", "angle_of_repose_deg"]
    packed = runs["hold_up"] > PACKED
    found = {
        "runs": len(runs),
        "packed": int(packed.sum()),
        "two_kinds": bool(packed.any() and not packed.all()),
        "held": _range(runs["hold_up"]),
        "first": len(first),
        "first_sd": f"{first.std():.2f}°",
        "screened": _packed_rows(kept),
        "lost": sorted(int(n) for n in _lost(kept)),
    }
    return found | (_two_kinds(runs, packed) if found["two_kinds"] else {})


def _two_kinds(runs, packed):
    """Both kinds of heaps beside each other."""
    steep, flat = (runs.loc[k, "angle_of_repose_deg"] for k in (packed, ~packed))
    error = np.hypot(steep.std() / np.sqrt(len(steep)), flat.std() / np.sqrt(len(flat)))
    return {
        "held_packed": _range(runs.loc[packed, "hold_up"]),
        "held_free": _range(runs.loc[~packed, "hold_up"]),
        "steeper": f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°",
        "steep": f"{steep.mean():.1f}° ± {steep.std():.2f}°",
        "flat": f"{flat.mean():.1f}° ± {flat.std():.2f}°",
    }


def _range(values):
    return f"{values.min():,.0f} to {values.max():,.0f}"


def _packed_rows(kept):
    """['2 (3,103 grains)', ...]: the screening's rows in which the funnel packed."""
    held = read_written(Path(kept) / "funnels.csv").query("stage == 'screening'")
    rows = read_written(Path(kept) / "screening" / "runs.csv")
    rows = rows.merge(held[["run_id", "hold_up"]], on="run_id")
    rows = rows[rows["hold_up"] > PACKED]
    return [f"{n} ({h:,.0f} grains)" for n, h in zip(rows["run"], rows["hold_up"], strict=True)]


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
        "verdict": validation.judged(v, "°"),
    }


def surface(kept: str | Path) -> dict[str, Any]:
    """Statistics of a response surface, and its oddest run."""
    kept = Path(kept) / "response_surface"
    summary = read_json(kept / "response_surface.json")
    s = summary["statistics"]
    runs = read_written(kept / "runs.csv").dropna(subset="response")
    fitted = fit_surface(runs, [c for c in runs if len(c) == 1], runs["response"])
    odd = fitted.diagnostics["externally_studentised"].abs()
    return {
        "cv": f"{s['CV_percent']:.2f} %",
        "r2": f"{s['R2']:.3f}",
        "predicted": f"{_predicted(summary):.2f}",
        "odd_run": int(runs["run"].iloc[int(odd.argmax())]),
        "odd": f"{odd.max():.1f}",
        "odd_from": f"{outlier_limit(fitted):.1f}",
    }


def _predicted(summary):
    """The predicted R2 of a surface; where one run decides a term alone, of the reduced model."""
    every = (summary, summary["reduced"])
    return next(s for m in every if (s := m["statistics"]["R2_pred"]) is not None)


def lost(kept: str | Path) -> str:
    """How many runs of screening, path and surface have no value. The path's table has only those
    with one."""
    without = valued = 0
    for stage in ("screening", "ascent", "response_surface"):
        folder = Path(kept) / stage
        without += len(read_json(folder / f"{stage}.json").get("left_out", []))
        valued += int(read_written(folder / "runs.csv")["response"].notna().sum())
    return f"{without} of {without + valued}"


def printed_fit(paper: str | Path = "data/paper") -> dict[str, str]:
    """The paper's summary of its fit (under Table 12)."""
    table = read_written(Path(paper) / "table12_summary.csv", comment="#").set_index("statistic")
    value = table["value"]
    return {
        "cv": f"{value['CV_percent']:.2f} %",
        "r2": f"{value['R2']:.2f}",
        "predicted": f"{value['R2_pred']:.2f}",
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
    """The screening at each of SEEDS, and all of them together: the paper's rows, and with the
    foldover where it was run."""
    rows: list[dict[str, Any]] = []
    every: list[pd.DataFrame] = []
    for seed, name in SEEDS.items():
        folder = Path(results) / name / "screening"
        here, effects = (read_written(folder / f) for f in ("runs.csv", "effects.csv"))
        every.append(here)
        own: pd.DataFrame = own_half(here)  # type: ignore[assignment]  # of a table that is there
        lost = ", ".join(str(k) for k in own.loc[own["response"].isna(), "run"]) or "none"
        big = effects[effects["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
        found = ", ".join(
            f"{label(n)} {degrees(e)}" for n, e in zip(big["name"], big["effect"], strict=True)
        )
        row = {"seed": seed, "lost": lost, "found": found or "none", "names": set(big["name"])}
        rows.append(row)
    paper = pd.concat([own_half(runs) for runs in every])
    whole = pd.concat(every)
    lost = whole.set_index("run")["response"].isna().groupby("run").sum()
    return {
        "rows": rows,
        "differ": len({frozenset(row["names"]) for row in rows}) > 1,
        "lost": [f"run {k} clogged in {n} of {len(SEEDS)} pours" for k, n in lost.items() if n],
        "folded": _together(whole) if len(whole) > len(paper) else None,
        **_together(paper),
    }


def _together(runs):
    """All runs of a screening's rows at several seeds: pure error, lack of fit, and the effects
    that the pure error shows."""
    runs = runs.dropna(subset="response")
    screened = screen(runs, list(CODES), runs["response"])
    told = aliasing(runs, list(CODES))
    lack = told["lack_of_fit"]
    anova, table = screened.anova.set_index("source"), screened.table.set_index("code")
    there = table[table["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
    carried = [len(pairs) for pairs in told["aliases"].values() if pairs]
    return {
        "heaps": len(runs),
        "sd": f"{screened.seed_sd:.2f}°",
        "freedom": f"{anova.loc['Pure Error', 'df']:.0f}",
        "lack": f"{lack['sd']:.1f}°",
        "lack_freedom": f"{anova.loc['Lack of Fit', 'df']:.0f}",
        "lack_test": f"F = {lack['F']:.0f}, p = {lack['p']:.0e}".replace("e-0", "e-"),
        "lack_there": lack["p"] < 0.05,
        "lack_pairs": lack["largest"],
        "lack_share": f"{lack['share']:.0%}".replace("%", " %"),
        "carried": max(carried, default=0),
        "vif": f"{told['vif']:.2f}",
        "found": [
            f"{c} {degrees(e)} ± {s:.1f}°"
            for c, e, s in zip(there.index, there["effect"], there["se"], strict=True)
        ],
    }


def speeds(history: str | Path = "results/reference/speed/history.csv") -> dict[str, Any]:
    """Million particle-steps per second of the last comparison with other engines, and of which
    engine it was; what two threads give, what a million grains take to come to rest, and which
    share of a heap's work belongs to grains at rest."""
    table = read_written(Path(history))
    last = table.groupby("case").last()
    of = last["particle_steps_per_s"]
    rests = [(case, m) for case in last.index if (m := AT_REST.fullmatch(case))]
    rests.sort(key=lambda found: float(found[1]["radii"]))
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
        "threads": f"{last.loc['one run on two threads', 'ratio']:.2f}",
        "million_minutes": f"{last.loc[MILLION, 'wall_time_s'] / 60:.0f}",
        "million_GiB": f"{last.loc[MILLION, 'peak_memory_MiB'] / 1024:.1f}",
        "million_rest": f"{RESTING:.0e}".replace("e-0", "e-"),
        "window_ms": rests[0][1]["ms"],
        "resting": [(m["radii"], f"{100 * last.loc[case, 'ratio']:.0f} %") for case, m in rests],
    }


def audited(paper: str | Path = "data/paper") -> int:
    """Number of printed figures and statements that the audit judges."""
    return len(run_audit(Path(paper)))


def locus(kept: str | Path) -> dict[str, str]:
    """Slope of the yield locus at the friction in use, with its 95 % interval, and the verdict on
    it."""
    shear = read_json(Path(kept) / "shear" / "shear.json")
    low, high = shear["peak"]["slope_interval"]
    slope, friction = shear["peak"]["slope"], shear["peak"]["particle_friction"]
    rows = read_written(Path(kept) / TABLE).set_index("id")
    return {
        "slope": f"{slope:.2f} ({low:.2f} to {high:.2f}, 95 %) at a friction of {friction:g}",
        "verdict": rows.loc["shear.slope", "agreement"],
    }


def trials(kept: str | Path) -> dict[str, dict[str, Any]]:
    """What the diagnosis says of two tables of measurements: `ball` and `paper`, each the causes
    that it names, or none."""
    found = {}
    for name, folder in (("ball", "table-tennis-ball"), ("paper", "salt-diagnosis")):
        one = read_json(Path(kept) / folder / "verdict.json")
        found[name] = {"verdict": one["verdict"], "causes": list(map(label, one["causes"]))}
    return found


RULES = {"paper": "the paper's rule", "gravity-consistent": "the gravity-consistent rule"}
CASES = {"plain": "without cohesion", "cohesive": "with cohesion"}


def scaling(kept: str | Path) -> dict[str, Any]:
    """What doubling grain and rig changes, by each rule, and whether the gravity-consistent rule
    gives the same runs four times as large."""
    table = read_written(Path(kept) / TABLE).set_index("id")
    runs = read_written(Path(kept) / "scaling" / "runs.csv").query("experiment == 'heap'")
    cases = ((rule, case) for rule in RULES for case in CASES)
    rows = {(r, c): table.loc[f"heap.{r}.{c}.twice"] for r, c in cases}
    return {
        "doubled": [
            f"{CASES[case]} by {RULES[rule]} {_changed(row)}" for (rule, case), row in rows.items()
        ],
        "fourfold": _changed(table.loc["heap.paper.plain"]),
        "runs": runs.groupby(["rule", "cohesive", "scale"]).size().min(),
        "same": _same_runs(runs[runs["rule"] == "gravity-consistent"]),
    }


def _changed(row):
    """'+2.5° (0.9 to 4.2, different)' of a row of the reproduction table."""
    low, high = fixed(row["low"], 1, "+"), fixed(row["high"], 1, "+")
    return f"{fixed(row['difference'], 1, '+')}° ({low} to {high}, {row['agreement']})"


def _same_runs(runs):
    """Whether the heaps at the first and the last scale are the same, seed by seed, to the last
    bit."""
    ends = [
        runs[runs["scale"] == h].set_index(["cohesive", "seed"])["response"]
        for h in (runs["scale"].min(), runs["scale"].max())
    ]
    both = pd.concat(ends, axis=1, join="inner").dropna()
    return len(both) > 0 and bool((both.iloc[:, 0] == both.iloc[:, 1]).all())


def rigs(kept: str | Path, config: str | Path = "config") -> dict[str, Any]:
    """What the runs of `paper.rigs` say of the rate of the pour and the speed that is not
    printed, by the rule that was stated before them."""
    table = read_written(Path(kept) / "runs.csv")
    found = judged(table)
    means = table[table["point"] == "candidate"].groupby(KEYS[1:])[READINGS[0]].mean()
    by_rig = found.set_index(["rate", "speed"])
    names = [f"{rate:,} a second at {speed} m/s" for rate, speed in by_rig.index]
    mixed = by_rig.index[~by_rig["one_kind"]]
    choice = chosen(found)
    poured = Study(config).config.run["geometry"]["generation_rate_per_s"]
    return {
        "default": f"{poured:,} a second",
        "runs": len(table),
        "planned": len(list(RATES)) * len(SPEEDS) * sum(seeds for _, seeds in POINTS.values()),
        "mean": {rate: [f"{means[rate, s]:.1f}°" for s in SPEEDS] for rate in RATES},
        "moves": {r: [f"{by_rig.loc[(r, s), 'moves']:.1f}°" for s in SPEEDS[:-1]] for r in RATES},
        "insensitive": f"{ALLOWED}°",
        "well_posed": [n for n, good in zip(names, found["well_posed"], strict=True) if good],
        "two_kinds": [
            f"{rate:,} a second at {speed} m/s ({by_rig.loc[(rate, speed), 'least']:,} to "
            f"{by_rig.loc[(rate, speed), 'most']:,} grains in the funnel)"
            for rate, speed in mixed
        ],
        "chosen": f"{choice[0]:,} a second at {choice[1]} m/s",
        "chosen_moves": f"{by_rig.loc[choice, 'moves']:.1f}°",
    }


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
