"""What the pages' templates cannot compute by themselves, from the kept results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from calibration.chain.joint.words import kinds
from calibration.chain.screening import aliasing
from calibration.errors import CalibrationError
from calibration.figures import label, response_of
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT
from calibration.statistics.numbers import fixed
from calibration.statistics.screening import screen
from calibration.telling.export.decks import NAMES as CODES
from calibration.telling.export.trials import rows_in, trials
from diagnosis.compared import told as size
from paper.release.parts import TRIED
from paper.reproduction.screening import CODES as FACTORS
from paper.reproduction.screening import own_half
from paper.reproduction.table import WHOLE
from paper.rigs import chosen, judged

PAPER = Path("data/paper")
PACKED = 1250
"""Most grains in the funnel at once [-] above which a pour of the paper's rig has packed: the two
kinds of pours lie hundreds of grains apart on either side of it."""
SEEDS = {1: "salt", 2: "salt-2", 3: "salt-3", 4: "salt-4"}
"""{seed: kept study} of the screening at other seeds."""
CONFIGURATIONS = {"salt": "config/config.yaml", "maize": "examples/maize/config.yaml"}
"""{kept study: configuration of its calibration to one target}."""
STIFFER = "full scale, shear modulus 10 MPa"
"""Variant of the study of the numerics."""
ENOUGH = 1.0 / 3.0
"""A third of the margin of 1 degree that the salt's validation asks for: decided before the ways
were tried."""
MARGIN = 2.0
"""Of a deck's angle [deg], where the heaps scatter less."""
SIMULATED = {
    "Table 6": "heaps of the screening",
    "Table 8": "sliding angles",
    "Table 9": "rebounds",
    "Table 10": "heaps along the ascent",
    "Table 11": "heaps of the region",
}
"""What the paper's tables of simulated values hold."""
HEAPS = ("Table 6", "Table 10", "Table 11")
STUDIES = {"in-liggghts": "LIGGGHTS", "in-lammps": "LAMMPS", "in-dem": "this engine"}
"""{study: code that made its runs}."""
ANSWER = (
    "optimum",
    "validated",
    "less the measured angle (95 %)",
    "parameters (95 %), and whether those of the measured heaps lie inside",
)
"""What is told of a study that was validated."""
NUMBERS = ("none", "one", "two", "three", "four", "five", "six", "seven")
FALL, GRAIN = "penetration-25K", 1e-3
"""Case of the bulk processes whose falls are compared, and the radius of its bed's grains [m]."""
END = 0.04
"""Time of the last look at a fall [s]."""
STARTS = {
    unit: ("dem", *(f"dem-moved-{k}-{short}" for k in (1, 2, 3, 4)))
    for unit, short in (("nanometres", "nm"), ("micrometres", "um"), ("tenths of a mm", "0.1mm"))
}
"""Runs of this engine whose starts differ by one to four of a unit: what chance makes of a fall."""


def counted(number: int) -> str:
    """A number up to seven in a word."""
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def degrees(value: float, digits: int = 1) -> str:
    """'+18.1°', with a true minus."""
    return f"{value:+.{digits}f}°".replace("-", "−")


# --- the README ---------------------------------------------------------------------------------


def strongest(table: pd.DataFrame) -> dict[str, Any]:
    """The factor with the largest effect, ours and the paper's, of a reproduction table by id."""
    rows = table.loc[[i for i in table.index if i.startswith("table07.")]]
    rows = rows.assign(theirs=rows["paper"].astype(float), ours=rows["this_project"].astype(float))
    ours, theirs = (rows.loc[rows[c].abs().idxmax()] for c in ("ours", "theirs"))
    names = [row["quantity"].removeprefix("effect of ") for row in (ours, theirs)]
    return {
        "name": names[0],
        "effect": degrees(ours["ours"]),
        "paper": degrees(ours["theirs"]),
        "same": names[0] == names[1],
        "theirs": names[1],
        "different": counted(int((rows["agreement"] == DIFFERENT).sum())),
        "all": counted(len(rows)),
    }


def tables(table: pd.DataFrame) -> dict[str, list[str]]:
    """{verdict: ['sliding angles (Table 8)', ...]} of the tables of simulated values."""
    found: dict[str, list[str]] = {DIFFERENT: [], EQUIVALENT: []}
    for item in WHOLE:
        verdict = table.loc[f"{item.lower().replace(' ', '')}.whole", "agreement"]
        found.setdefault(verdict, []).append(f"{SIMULATED[item]} ({item})")
    return found


def bounded(kept: Path) -> dict[str, Any]:
    """How many parameters the posterior of a study bounds, and that of all its tests, as (so many,
    of so many) in words; and whether the tests contradict each other."""
    alone = read_json(kept / "posterior" / "posterior.json")["parameters"]
    every = read_json(kept / "joint" / "joint.json")
    return {
        "alone": (counted(sum(p["bounded"] for p in alone.values())), counted(len(alone))),
        "together": (counted(len(kinds(every)["bounded"])), counted(len(every["parameters"]))),
        "contradict": every["agreement"]["contradicts"],
    }


# --- the paper's results ------------------------------------------------------------------------


def funnels(kept: Path) -> dict[str, Any]:
    """How many runs packed the funnel, by how much their heaps are steeper where others did not
    (None elsewhere), and the numbers of the screening's runs without a value."""
    table = read_written(kept / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna(subset=["angle_of_repose_deg", "hold_up"])
    packed, steeper = runs["hold_up"] > PACKED, None
    if packed.any() and not packed.all():
        steep, flat = (runs.loc[k, "angle_of_repose_deg"] for k in (packed, ~packed))
        error = np.hypot(steep.std() / np.sqrt(len(steep)), flat.std() / np.sqrt(len(flat)))
        steeper = f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°"
    screened = read_written(kept / "screening" / "runs.csv")
    lost = sorted(map(int, screened.loc[screened["response"].isna(), "run"]))
    return {"runs": len(runs), "packed": int(packed.sum()), "steeper": steeper, "lost": lost}


def screening(kept: Path) -> dict[str, Any]:
    """Effects of a study's screening beside the paper's."""
    table = read_written(kept / "screening" / "effects.csv").set_index("code")
    paper = read_written(PAPER / "table06_plackett_burman.csv", comment="#")
    printed = {c: float((paper["angle_deg"] * paper[c]).mean() * 2.0) for c in FACTORS}
    off = np.sqrt(np.mean([(table["effect"][c] - printed[c]) ** 2 for c in FACTORS]))
    return {
        "effect": {c: degrees(table["effect"][c]) for c in FACTORS},
        "printed": {c: degrees(printed[c], 2) for c in FACTORS},
        "se": f"{table['se'].iloc[0]:.2f}°",
        "off": f"{off:.1f}°",
        "found": [c for c in FACTORS if table["p"][c] < 0.05],
    }


def other_seeds(kept: Path) -> dict[str, Any]:
    """The screening at all of SEEDS together: the paper's rows, and with the foldover where it was
    run (`folded`)."""
    runs = [read_written(kept / name / "screening" / "runs.csv") for name in SEEDS.values()]
    paper, whole = pd.concat(map(own_half, runs)), pd.concat(runs)
    return _together(paper) | {"folded": _together(whole) if len(whole) > len(paper) else None}


def _together(runs):
    """How many heaps all runs of a screening's rows are, the effects that their pure error shows,
    and the most interactions of which one carries a part."""
    runs = runs.dropna(subset="response")
    table = screen(runs, FACTORS, runs["response"]).table.set_index("code")
    there = table[table["p"] < 0.05].sort_values("effect", key=abs, ascending=False)
    aliases = aliasing(runs, FACTORS)["aliases"].values()
    return {
        "heaps": len(runs),
        "carried": max(map(len, aliases), default=0),
        "found": [f"{r.Index} {degrees(r.effect)} ± {r.se:.1f}°" for r in there.itertuples()],
    }


def without_value(kept: Path) -> str:
    """How many runs of screening, path and surface have no value. The path's table has only those
    with one."""
    without = valued = 0
    for stage in ("screening", "ascent", "response_surface"):
        without += len(read_json(kept / stage / f"{stage}.json").get("left_out", []))
        valued += int(read_written(kept / stage / "runs.csv")["response"].notna().sum())
    return f"{without} of {without + valued}"


def rigs(kept: Path) -> dict[str, Any]:
    """What the runs of `paper.rigs` say of the rate of the pour and the speed that is not
    printed, by the rule that was stated before them."""
    table = read_written(kept / "runs.csv")
    found = judged(table).set_index(["rate", "speed"]).assign(words=lambda t: t.index.map(_rig))
    return {
        "runs": len(table),
        "moves": {
            rate: [f"{m:.1f}°" for m in own["moves"].dropna()]
            for rate, own in found.groupby(level=0)
        },
        "well_posed": list(found.loc[found["well_posed"], "words"]),
        "two_kinds": [
            f"{r.words} ({r.least:,} to {r.most:,} grains in the funnel)"
            for r in found[~found["one_kind"]].itertuples()
        ],
        "chosen": _rig(chosen(found.reset_index())),
        "chosen_moves": f"{found.loc[chosen(found.reset_index()), 'moves']:.1f}°",
    }


def _rig(at):
    return f"{at[0]:,} a second at {at[1]} m/s"


def softening(table: pd.DataFrame) -> str:
    """What softening the grains to 3 MPa changes at full scale, in sentences, of the table of the
    study of the numerics: at each point, and over all of them with Welch's 95 % interval."""
    stiff = table[table["variant"] == STIFFER]
    soft = (
        table[table["variant"] == stiff["against"].iloc[0]].set_index("point").loc[stiff["point"]]
    )
    parts = np.concatenate([t["sd"] ** 2 / t["n"] for t in (stiff, soft)]) / len(stiff) ** 2
    counts = np.concatenate([stiff["n"], soft["n"]])
    freedom = parts.sum() ** 2 / (parts**2 / (counts - 1)).sum()
    half = stats.t.ppf(0.975, freedom) * np.sqrt(parts.sum())
    each = ", ".join(
        f"{r.difference:+.2f}° ({r.low:+.2f} to {r.high:+.2f}) at {r.point}"
        for r in stiff.itertuples()
    )
    mean = stiff["difference"].mean()
    shown = abs(mean) > half
    advice = (
        "Correct an angle by this where it is to stand for 10 MPa."
        if shown
        else "So no change is shown."
    )
    return (
        f"With 10 MPa in place of 3 MPa the angle at full scale changes by {each}. On average it "
        f"changes by {mean:+.2f}° ({mean - half:+.2f} to {mean + half:+.2f}). All intervals are of "
        f"95 %. {advice}"
    )


def simulations(kept: Path) -> dict[str, Any]:
    """{table: what `diagnosis.compared.compare` says} of a kept study; of the tables of heaps where
    causes were tried with several seeds at a row, in the studies beside it."""
    folders = (kept, *(kept.parent / f"{kept.name}-{causes}" for causes in TRIED))
    made = [f / "disagreement" / "disagreement.json" for f in folders]
    found = [read_json(path) for path in made if path.is_file()]
    if not found:
        raise CalibrationError(f"{kept}: holds no disagreement; `snakemake disagreement` makes it")
    own, *more = found
    return own | ({name: _of_all([one[name] for one in more]) for name in HEAPS} if more else {})


def _of_all(found):
    """One table as several studies of the same rows found it: every cause that was tried, with the
    greatest of its chances, as the best of more causes is as good by chance more often."""
    causes: dict[str, dict] = {}
    for cause in (c for one in found for c in one["ranking"]):
        known = causes.get(cause["cause"])
        if known is None or cause["p"] > known["p"]:
            causes[cause["cause"]] = cause
    ranking = sorted(causes.values(), key=lambda cause: -cause["gain"])
    return next(one for one in found if ranking[0] in one["ranking"]) | {"ranking": ranking}


def differs(one: Mapping[str, Any]) -> list[str]:
    """Cells of a table of simulated values: what it differs by, the verdict, the cause that
    predicts it best, what that leaves and its chance."""
    best, unit = one["ranking"][0], one["unit"]
    at = f" at {best['strength']:.3g} {best['unit']}".removesuffix(" 1") if best["unit"] else ""
    cause = f"{best['cause'].replace('_', ' ')}{at} (p = {best['p']:.2g})"
    left = size(best["scatter_after"], unit)
    if best["p_left"] is not None:
        left += f" (p = {best['p_left']:.1g})"
    cells = size(one["scatter_before"], unit), one["verdict"], cause, left
    return [cell.replace(" deg", "°") for cell in cells]


# --- studies by all their tests -----------------------------------------------------------------


def joint(kept: Path) -> dict[str, Any]:
    """What one kept study says: what the calibration to one target gives in every test, and what
    that to all targets gives."""
    fixed_at = yaml.safe_load(Path(CONFIGURATIONS[kept.name]).read_text("utf-8")).get("fixed", {})
    found, single = read_json(kept / "joint" / "joint.json"), _machines(kept, "push_through")
    both, parameters = _machines(kept, "joint_push_through"), found["parameters"]
    path = kept / "posterior" / "parameters.csv"
    rows = read_written(path).to_dict("records") if path.is_file() else []
    alone = {r["parameter"]: (r["low"], r["high"]) for r in rows}
    return {
        "tests": [_test(target, single, both) for target in found["targets"]],
        "parameters": [
            {
                "name": label(name),
                "levels": _ends(found["box"][name]),
                "single": _ends(alone[name])
                if name in alone
                else f"held at {fixed_at[name]:g}"
                if name in fixed_at
                else "held",
                "joint": _ends(p["interval"]),
            }
            for name, p in parameters.items()
        ],
        "outside": outside(parameters, {n: v for n, v in fixed_at.items() if n not in alone}),
        "largest_pull": fixed(max(abs(t["pull_others"]) for t in found["targets"]), 1),
    }


def _machines(kept, stage):
    """Rows of what the draws of a posterior gave in the machines; none where none was run."""
    path = kept / stage / f"{stage}.json"
    return read_json(path)["metrics"] if path.is_file() else []


def _test(target, single, both):
    """A target beside what each calibration gives in its test."""
    metric, measured = response_of(target["metric"]), target["measured"]
    return {
        "name": f"{label(target['rig'])}, {metric.name}",
        "measured": metric.value(measured),
        "single": _given(_machine(target, single), measured, metric),
        "joint": _given(_machine(target, both), measured, metric)
        or f"{metric.value(target['predicted'])}, {_missed(target['predicted'], measured)}",
    }


def _machine(target, machines):
    """The machine that is the target's rig: by its name, else the only one with its metric."""
    same = [m for m in machines if m["metric"] == target["metric"]]
    return next((m for m in same if m["machine"] == target["rig"]), same[0] if same else None)


def _given(row, measured, metric):
    """Mean with the interval of a further run, by how much the mean misses, and whether the
    measured value lies in the interval; empty without runs."""
    if row is None:
        return ""
    if row["low"] is None:
        return "no value"
    ends = f"{metric.value(row['low'])} to {metric.value(row['high'])}"
    where = "inside" if row["low"] <= measured <= row["high"] else "outside"
    return f"{metric.value(row['mean'])} ({ends}), {_missed(row['mean'], measured)}, {where}"


def _missed(value, measured):
    return f"{fixed(100.0 * (value / measured - 1.0), 1, '+').replace('-', '−')} %"


def outside(parameters: Mapping[str, Any], held: Mapping[str, float]) -> list[str]:
    """ "name (value)" of the parameters that one target's calibration holds outside the interval by
    all."""
    ends = {n: parameters[n]["interval"] for n in held if n in parameters}
    return [
        f"{label(n)} ({held[n]:g})" for n, (low, high) in ends.items() if not low <= held[n] <= high
    ]


def _ends(ends):
    return f"{ends[0]:.3g} to {ends[1]:.3g}"


# --- evidence and other codes -------------------------------------------------------------------


def ways(kept: Path) -> dict[str, Any]:
    """The comparison of ways to calibrate. `of` gives a column at each number of runs, in words.
    The ways of libraries that are not installed here stand as they were found when they were."""
    own, others = (read_written(kept / f"{name}.csv") for name in ("summary", "libraries"))
    every = pd.concat([own[~own["way"].isin(others["way"])], others])

    def of(responses, way, column, digits):
        rows = every[(every["responses"] == responses) & (every["way"] == way)]
        return [fixed(value, digits) for value in rows.sort_values("runs")[column].dropna()]

    groups: dict[int | None, list[str]] = {}
    for way, runs in runs_needed(own[own["responses"] == "smooth"]).items():
        groups.setdefault(runs, []).append(way)
    return {
        "ways": list(dict.fromkeys(every["way"])),
        "enough": sorted(groups.items(), key=lambda group: group[0] or math.inf),
        "of": of,
        "most": own["runs"].max(),
        "others_date": others["made"].max(),
    }


def runs_needed(found: pd.DataFrame) -> dict[str, int | None]:
    """Return {way: fewest runs whose error is at most ENOUGH, or None}."""
    good = found[found["rmse"] <= ENOUGH].groupby("way")["runs"].min()
    return {way: int(good[way]) if way in good else None for way in dict.fromkeys(found["way"])}


def bulk(kept: Path) -> dict[str, Any]:
    """The bulk processes that others chose: speeds of the codes, and how far their spheres fall
    apart."""
    speeds, runs = read_written(kept / "speeds.csv"), read_written(kept / "runs.csv")
    names = {"dem": "this engine", **CODES}
    here = runs[runs["case"] == FALL]
    falls = {
        code: read_written(kept / f"{FALL}.{code}.csv").set_index("time_s")["height_m"]
        for code in here["code"]
    }
    ours, others = falls["dem"], {names[c]: falls[c] for c in CODES if c in falls}
    starts = {u: [falls[c] for c in own if c in falls] for u, own in STARTS.items()}
    return {
        "speeds": [_speeds(case, own, names) for case, own in speeds.groupby("case", sort=False)],
        "codes": list(names.values()),
        "machine": " and ".join(sorted(speeds["machine"].unique())),
        "date": speeds["date"].max(),
        "engine": runs.loc[runs["code"] == "dem", "engine"].iloc[-1],
        "apart": {name: _apart(ours, fall) for name, fall in others.items()},
        "lowest_ms": f"{1000 * ours.idxmin():g}",
        "chance": {
            name: {unit: _chance(own, fall) for unit, own in starts.items() if len(own) > 2}
            for name, fall in others.items()
        },
    }


def _speeds(case, rows, names):
    """A case's row of the table: million particle-steps a second of each code, with the part of
    this engine's that it is."""
    rates = (rows.set_index("code")["particle_steps_per_s"] / 1e6).to_dict()
    parts = {c: "" if c == "dem" else f" (1/{rates['dem'] / rates[c]:.3g})" for c in rates}
    cells = [f"{rates[c]:.3g}{parts[c]}" if c in rates else "not run" for c in names]
    return {"case": case, "grains": f"{int(rows['grains'].iloc[0]):,}", "cells": cells}


def _at(fall, time):
    """Height at the look nearest to a time."""
    return fall.iloc[abs(fall.index - time).argmin()]


def _apart(ours, fall):
    """Largest distance of a code's sphere from ours at a common look, on the way down and at any,
    in radii of a grain."""
    looks = fall.index[fall.index <= ours.index.max() + 1e-9]
    off = [abs(_at(ours, look) - fall[look]) / GRAIN for look in looks]
    down = [d for d, look in zip(off, looks, strict=True) if look < ours.idxmin()]
    return fixed(max(down), 2), fixed(max(off), 2)


def _chance(starts, fall):
    """p of another code's last height as one more of the starts' (t test of one new value)."""
    own = np.array([_at(start, END) for start in starts])
    error = own.std(ddof=1) * math.sqrt(1.0 + 1.0 / len(own))
    return float(2.0 * stats.t.sf(abs(_at(fall, END) - own.mean()) / error, len(own) - 1))


def deck_trials() -> dict[str, Any]:
    """Decks with the numbers as they are, beside this engine: the angles of the kept heaps
    (`calibration.telling.export.trials`)."""
    kept, names = trials(), {"dem": "this engine", **CODES}
    told = []
    for name, trial in kept["trials"].items():
        found = {c: rows_in(c, name, MARGIN)[1] for c in CODES if c in trial["heaps"]}
        told.append((name, next(iter(found.values())), found))
    return {
        "poured": [f"{names[code]} `{version}`" for code, version in kept["poured_by"].items()],
        "codes": {c: CODES[c] for _, _, found in told for c in found},
        "trials": told,
    }


def code_studies(kept: Path) -> dict[str, dict[str, str]]:
    """{code: {row of the table: cell}} of one study of heaps in three codes: what each took and
    found, and whether the values lie in its intervals with which the heaps were made that count as
    measured."""
    made_with = yaml.safe_load(Path("examples/other-codes/config.yaml").read_text("utf-8"))["fixed"]
    here = {name: code for name, code in STUDIES.items() if (kept / name).is_dir()}
    return {code: _study(kept / name, made_with) for name, code in here.items()}


def _study(kept, made_with):
    times, found = read_json(kept / "times.json"), dict.fromkeys(ANSWER, "none")
    if not times["ended"]:
        optimum = read_json(kept / "optimise" / "optimum.json")["optimum"]
        v = read_json(kept / "validation" / "validation.json")
        ends = (fixed(v[f"difference{end}"], 1, "+") for end in ("", "_low", "_high"))
        apart = "{}° ({} to {})".format(*ends).replace("-", "−")
        intervals = (
            f"{label(r.parameter)} {r.low:.3g} to {r.high:.3g} ({made_with[r.parameter]:.3g} "
            f"{'inside' if r.low <= made_with[r.parameter] <= r.high else 'outside'})"
            for r in read_written(kept / "posterior" / "parameters.csv").itertuples()
        )
        cells = (
            ", ".join(f"{label(k)} {x:.3g}" for k, x in optimum.items()),
            f"{v['simulated_mean']:.1f}° (sd {v['simulated_sd']:.1f}, {v['simulated_n']} heaps)",
            apart,
            "; ".join(intervals),
        )
        found = dict(zip(ANSWER, cells, strict=True))
    runs = {"runs, those without a value": f"{times['runs']}, {times['without_value']}"}
    verdict = read_json(kept / "diagnosis" / "verdict.json")["verdict"]
    return runs | found | {"verdict of the diagnosis": verdict}
