"""Marks of one verdict, as marks.yaml has them; the rates of many are in figures.csv."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from benchmarks.rates.kept_rates import CLAIMS
from benchmarks.rates.strangers import nature
from benchmarks.rates.strangers.cases import PROPORTIONAL, Case, Drawn
from diagnosis.laws.known import COEFFICIENT

LEVER = {
    "speed": "drop_height_mm",
    "size": "particle_diameter_mm",
    "rate": "tilt_rate_deg_s",
    "load": "normal_stress_kPa",
    "interval": "output_interval_s",
}
"""State of a law: the lever that sets it; a speed is that of a fall from its height."""
MARKS = [*yaml.safe_load(Path(__file__).with_name("marks.yaml").read_text())]
CLEAN = ("null", "two-level null", "declared")
GAIN = "held_out_rmse_difference_interval"


def place(law):
    """(experiment, slot, states) of an entry; None where it is no law."""
    if law.get("slot") is None:
        return None
    return law.get("experiment"), law["slot"], tuple(sorted(law.get("state") or ()))


def _is(said, law):
    """Return whether a place that was said is the law's; a rival may leave out the experiment."""
    right = {(slot, tuple(sorted(state))) for slot, state in law.places}
    return said is not None and said[0] in (None, law.experiment) and said[1:] in right


def own_misfit(table: pd.DataFrame) -> float:
    """p of an analysis of variance: constant coefficients (and declared batches and instruments)
    against the scatter within settings, of the experiment that fits worst, times their number."""
    ps = [_variance_ratio(experiment, rows) for experiment, rows in table.groupby("experiment")]
    return float(min(1.0, len(ps) * min(ps)))


def _variance_ratio(experiment, rows):
    scale = rows[PROPORTIONAL[experiment]] if experiment in PROPORTIONAL else 1.0
    y = (rows["value"] / scale).to_numpy(float)
    design = np.ones((len(rows), 1))
    for column in (c for c in ("batch", "instrument") if c in rows and rows[c].notna().any()):
        design = np.hstack([design, pd.get_dummies(rows[column], dtype=float).to_numpy()[:, 1:]])
    left, freedom = _left(y, design)
    if "n" in rows:
        m = int(rows["n"].iloc[0])
        within_freedom = len(rows) * (m - 1)
        within = within_freedom * float(((rows["sd"] / scale) ** 2).mean()) / m
    else:  # single readings, beside a level of each setting
        keys = [c for c in LEVER.values() if c in rows]
        settings = rows.groupby(keys, dropna=False).ngroup()
        within, within_freedom = _left(
            y, np.hstack([design, pd.get_dummies(settings, dtype=float)])
        )
        left, freedom = left - within, freedom - within_freedom
    if within <= 0.0:
        return 0.0
    ratio = (left / freedom) / (within / within_freedom)
    return float(stats.f.sf(ratio, freedom, within_freedom))


def _left(y, design):
    """(sum of squares, degrees of freedom) that a design leaves."""
    miss = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    return float((miss**2).sum()), len(y) - np.linalg.matrix_rank(design)


def marks(case: Case, drawn: Drawn, said: dict) -> dict:
    """Return what is right and wrong in a verdict; None where it is not asked."""
    laws, errors = said.get("laws") or [], said.get("errors") or []
    found = [place(law) for law in laws]
    rivals = [r for owner in (said, *laws, *errors) for r in owner.get("rivals") or []]
    names = sorted({n for law in laws for n in law.get("names") or ()})
    claims = said["verdict"] in CLAIMS
    misfit = (said.get("misfit") or {}).get("p")
    own, stated = own_misfit(drawn.table), 1.0 if misfit is None else misfit
    # readings that are rounded to one value show no spread: where that is told, nothing is silent
    coarse = any(e.get("of") == "resolution" for e in errors)
    adequate, held = said["verdict"] == "adequate" and not coarse, limits(drawn, said)
    row = dict.fromkeys(MARKS) | {
        "verdict": said["verdict"],
        "laws": "; ".join(f"{p[0]}:{p[1]}:{'x'.join(p[2])}" for p in found if p),
        "names": "; ".join(names),
        "errors": "; ".join(f"{e.get('experiment')}:{e.get('of')}" for e in errors),
        "rows": " ".join(str(r["line"]) for r in said.get("rows") or []),
        "misfit_p": misfit,
        "own_p": own,
        "claimed": int(claims),
        "adequate_wrongly": int(adequate and (own < 1e-3 or stated < 0.01)),
        "wrong_name": 0,
        "limits": held[0],
        "limits_held": held[1],
        "band": in_band(drawn, laws),
    }
    right = {n for law in drawn.laws for n in law.names}
    if said["verdict"] == "identified":
        row["wrong_name"] = int(any(not set(law.get("names") or ()) <= right for law in laws))
    if any(law.get("gain") for law in laws):  # the engine was asked
        ends = [law["gain"].get(GAIN) for law in laws if law["names"] and law.get("gain")]
        row["name_loses"] = int(any(end and max(end) < 0.0 for end in ends))
    row |= {"true": len(drawn.laws), "placed": len(laws)}
    row["hits"] = sum(any(_is(p, law) for p in found) for law in drawn.laws)
    causes = [law for law in drawn.laws if law.names and law.experiment in COEFFICIENT]
    if causes:
        alone = [own for own in map(set, (law.get("names") or () for law in laws)) if len(own) == 1]
        row["causes"] = len(causes)
        row["alone"] = sum(any(own <= {*law.names} for own in alone) for law in causes)
    if drawn.laws:
        two_levels = case.group == "two-level law"
        seen = [*found, *map(place, rivals)] if two_levels else found[:1]
        row["leads"] = int(any(_is(p, law) for p in seen for law in drawn.laws))
        row["named"] = int(bool(right & set(names))) if right else None
    else:
        doubted = case.group in CLEAN and said["verdict"] in ("ambiguous", "failed")
        row["silent"] = int(not claims and not doubted)
    if len(drawn.laws) == 2:
        row["both"] = int(all(any(_is(p, law) for p in found) for law in drawn.laws))
    if fault := drawn.fault:
        kinds = [e.get("experiment") for e in [*errors, *rivals] if e.get("of") == fault.of]
        if case.group in ("row", "level"):
            lever = case.group == "level" and fault.experiment in kinds
            row["pointed"] = int(lever or _pointed(fault, said))
        else:
            row["fault"] = int(None in kinds or fault.experiment in kinds)
    return row


def in_band(drawn, laws):
    """Return whether the true curve lies in the first law's band; None where this cannot be
    compared: not the right place, a second law there, or no curve of a coefficient over one
    state."""
    if not laws or len(drawn.laws) != 1:
        return None
    law, [own] = laws[0], drawn.laws
    values, state = law.get("values"), tuple(law["state"])
    if not own.factor or not _is(place(law), own) or not values or law["slot"] == "attraction":
        return None
    # a slide's load is known by the size alone
    if len(state) != 1 or state[0] not in LEVER or (own.experiment, *state) == ("tilt", "load"):
        return None
    at = np.array([v["state"] for v in values])
    at = at**2 / (2e-3 * nature.G) if state == ("speed",) else at
    factor = nature.evaluated(own.factor, {LEVER[state[0]]: at}, own.k)
    true = drawn.constants[own.experiment] * factor
    return int(all(v["low"] <= t <= v["high"] for v, t in zip(values, true, strict=True)))


def _pointed(fault, said):
    lines = {int(r["line"]) for r in said.get("rows") or []}
    hit, wrong = lines & set(fault.lines), lines - set(fault.lines)
    return 2 * len(hit) >= len(fault.lines) and len(wrong) <= len(fault.lines)


def limits(drawn, said):
    """(limits of free laws on experiments without a law, how many of them do not exclude zero)."""
    acting = {law.experiment for law in drawn.laws}
    # a row or a level that is wrong pulls at a limit as a law does; errors that are shared must be
    # paid for
    acting |= {drawn.fault.experiment} if drawn.fault and drawn.fault.lines else set()
    slots, held = {"restitution": "drop", "drag": "drop"}, []
    for e in said.get("exclusion") or []:
        ends = e.get("below"), e.get("above")
        if e.get("slot") and ends != (None, None):
            if (e.get("experiment") or slots.get(e["slot"])) not in acting:
                held.append((ends[0] or 0.0) <= 0.0 <= (ends[1] or 0.0))
    return len(held), int(np.sum(held))
