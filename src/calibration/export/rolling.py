"""Rolling friction in another law: which coefficient gives the same angle of repose.

The law calibrated with (usually EDEM's constant torque on each grain's own spin) is missing from most codes. Theirs act
on the relative spin of two grains. With the same number, or with the number that makes the torques equal, their heaps
are flatter by about ten degrees, because grains that turn together feel nothing. No formula leads from one coefficient
to the other, so the angle is measured: this engine has both kinds of law.

The search raises the rolling friction of grain on grain in that law, from less than the calibrated number to so much
that grains slide before they roll. Everything else stays. The angle along this path is made monotone and inverted for
the angle that the calibrated law gives; runs at the number found confirm it. Where the path does not come to the angle
(grains that cannot roll on each other still slide, twist and turn together), the smallest number that is as good as the
best is taken, and the exports say what is missing.

The path is run with fewer, larger grains of the same total volume in the same rig (MOST_GRAINS), both laws alike; the
confirmation also at the study's own scale.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from calibration.campaign import read_metric, run_id, write_plan
from calibration.config import overlay, point_spec
from calibration.statistics.validate import compare
from dem.errors import SpecError
from dem.spec import parse_spec

SEARCHED = ("elastic_plastic",)
"""Laws that other codes have and that mean the same there. `constant_torque_relative` is none of them: LIGGGHTS' `cdt`
does not stop at a reversal of the spin, and its heaps are flatter than ours."""
PATH = (-0.25, 0.0, 0.3333, 0.6667, 1.0)
"""Places on the path: 0 the calibrated number, 1 its top, with equal ratios between."""
MOST_ROLLING = 5.0  # what a run spec allows
OWN_SEEDS, PATH_SEEDS, CONFIRM_SEEDS, FULL_SEEDS = 6, 3, 5, 3
MOST_GRAINS = 2500
REST_TIME = 2.0
"""A heap is at rest about this long after the last grain was made [s]; rolling springs keep trembling, so that the
energy of such a heap never falls to that of rest."""
STIFFNESS_FACTOR, DAMPING_RATIO = 2.25, 0.3


def place(share, pair):
    """Rolling friction of grain on grain at a place of the path, from the calibrated contact (`ContactSpec`).

    The top is 2 mu_s: the limit mu_r R* F_n is then mu_s R F_n for equal grains, all that sliding friction can turn a
    grain with, so that a larger number changes nothing. Rounded, as levels name cached runs.
    """
    mu = pair.rolling_friction
    top = min(2.0 * max(pair.static_friction, mu), MOST_ROLLING)
    return round(min(mu * (top / mu) ** share, MOST_ROLLING), 6)


def laws_to_scan(spec):
    """Laws of SEARCHED that the calibrated `RunSpec` does not have; none where grains roll freely, and none where no
    heap was calibrated, so that there is no angle to keep."""
    free = spec.laws.rolling == "none" or spec.contacts.particle_particle.rolling_friction == 0.0
    if free or spec.experiment != "heap":
        return []
    return [law for law in SEARCHED if law != spec.laws.rolling]


def calibrated_spec(config, factors, optimum, seed=None):
    """Run spec (a mapping) at the calibrated point {factor: level}; the study's first seed unless given."""
    levels = config.fixed | optimum
    keys = {f.key: levels[f.name] for f in factors if f.name in levels}
    return point_spec(config.run, config.experiment, keys, config.seed if seed is None else seed)


def coarse(spec):
    """A heap's run spec (a mapping) with at most MOST_GRAINS larger grains of the same total volume; as it is where
    these would not pass the funnel."""
    parsed = parse_spec(spec)
    if parsed.particles.count <= MOST_GRAINS:
        return spec
    ratio = parsed.particles.count / MOST_GRAINS
    changes = {
        "particles": {
            "count": MOST_GRAINS,
            "scale_factor": round(parsed.particles.scale_factor * ratio ** (1 / 3), 6),
        },
        "geometry": {"generation_rate_per_s": parsed.geometry.generation_rate_per_s / ratio},
    }
    try:
        parse_spec(overlay(spec, changes))
    except SpecError:
        return spec
    return overlay(spec, changes)


def timed(spec):
    """The run spec (a mapping) of a heap that ends a fixed time after the last grain was made."""
    parsed = parse_spec(spec)
    pouring = parsed.particles.count / parsed.geometry.generation_rate_per_s
    end = min(round(pouring + REST_TIME, 3), parsed.numerics.max_time_s)
    return overlay(spec, {"numerics": {"max_time_s": end}})


def with_law(spec, law, rolling):
    """The run spec (a mapping) with another rolling law and coefficient of grain on grain."""
    changes = {
        "laws": {"rolling": law},
        "contacts": {"particle_particle": {"rolling_friction": rolling}},
    }
    if law == "elastic_plastic":
        changes["law_parameters"] = {
            "rolling_stiffness_factor": STIFFNESS_FACTOR,
            "rolling_damping_ratio": DAMPING_RATIO,
        }
    given = spec.get("law_parameters", {})
    kept = {key: value for key, value in given.items() if not key.startswith("rolling_")}
    return overlay(spec | {"law_parameters": kept}, changes)


def _rows(base, law, share, seeds, scale):
    """Design rows and {run_id: spec} of one point; law None: as calibrated."""
    own = parse_spec(base)
    pair = own.contacts.particle_particle
    changed = base if law is None else with_law(base, law, place(share, pair))
    rows, specs = [], {}
    for n in range(seeds):
        spec = timed(overlay(changed, {"seed": base["seed"] + n}))
        name = run_id(spec)
        specs[name] = spec
        rows.append(
            {
                "law": law or own.laws.rolling,
                "scale": scale,
                "share": share,
                "rolling_friction": pair.rolling_friction if law is None else place(share, pair),
                "seed": spec["seed"],
                "run_id": name,
            }
        )
    return rows, specs


def _write(parts, folder):
    rows = [row for part, _ in parts for row in part]
    specs = {name: spec for _, part in parts for name, spec in part.items()}
    columns = ["law", "scale", "share", "rolling_friction", "seed", "run_id"]
    write_plan(folder, pd.DataFrame(rows, columns=columns), specs)


def plan_scan(spec, folder):
    """Plan runs of the calibrated law and along each other law's path; spec: calibrated run spec (a mapping)."""
    parts, laws = [], laws_to_scan(parse_spec(spec))
    if laws:
        base = coarse(spec)
        parts = [_rows(base, None, 0.0, OWN_SEEDS, "coarse")]
        parts += [_rows(base, law, s, PATH_SEEDS, "coarse") for law in laws for s in PATH]
    _write(parts, folder)


def read_scan(design_file, metric):
    """The design table with the runs' angles in `response`."""
    design = pd.read_csv(design_file)
    return design.assign(response=read_metric(design["run_id"], metric))


@dataclass(frozen=True)
class Inverse:
    """Where on the path a law gives the angle: share, and what the scan says of it [unit of the angle]."""

    share: float
    reached: bool
    same_number: float
    smallest: float
    largest: float


def invert(shares, angles, target):
    """`Inverse` of angles (n,) at shares (n,) for a target angle.

    The means at each share are made monotone (running maximum) and interpolated linearly. Below the path's range its
    start is returned, above it the first share whose mean is within a standard error of the largest; `reached` is then
    False.
    """
    groups = pd.Series(np.asarray(angles, float)).groupby(np.asarray(shares))
    means = groups.mean().sort_index()
    x, y = means.index.to_numpy(), np.maximum.accumulate(means.to_numpy())
    reached = bool(y[0] <= target <= y[-1])
    if reached:
        k = max(int(np.searchsorted(y, target)), 1)
        share = x[k - 1] + (target - y[k - 1]) / (y[k] - y[k - 1]) * (x[k] - x[k - 1])
    elif target < y[0]:
        share = x[0]
    else:
        error = np.sqrt(groups.var(ddof=1).mean() / groups.size().mean())
        share = x[np.flatnonzero(y >= y[-1] - np.nan_to_num(error))[0]]
    return Inverse(float(share), reached, float(means[0.0]), float(y[0]), float(y[-1]))


def inverses(scan, spec):
    """{law: Inverse} of a scan (table with `response`) for the calibrated `RunSpec`; laws without runs are left out."""
    own = scan[scan["law"] == spec.laws.rolling]["response"].mean()
    found = {}
    for law in [law for law in laws_to_scan(spec) if (scan["law"] == law).any()]:
        runs = scan[scan["law"] == law]
        found[law] = invert(runs["share"], runs["response"], own)
    return found


def plan_confirmation(spec, scan_file, metric, folder):
    """Plan runs at the point found for each law, on the scan's scale and on the study's own."""
    parts, parsed = [], parse_spec(spec)
    scan = read_scan(scan_file, metric)
    for law, found in inverses(scan, parsed).items():
        base = coarse(spec)
        share = round(found.share, 4)
        parts.append(_rows(base, law, share, CONFIRM_SEEDS, "coarse"))
        if base is not spec:
            parts.append(_rows(spec, law, share, FULL_SEEDS, "full"))
    _write(parts, folder)


def conclude(spec, scan, confirmation, validated, margin, unit):
    """The conversion as a mapping for rolling.json.

    spec: calibrated `RunSpec`; scan, confirmation: tables with `response`; validated: (n,) angles of the calibrated law
    at the study's own scale; margin: difference that does not matter; unit: of both.
    """
    own = scan[scan["law"] == spec.laws.rolling]["response"]
    pair = spec.contacts.particle_particle
    out = {"law": spec.laws.rolling, "unit": unit, "laws": {}}
    out["rolling_friction"] = pair.rolling_friction
    for law, found in inverses(scan, spec).items():
        runs = confirmation[confirmation["law"] == law]
        entry = {
            "rolling_friction": place(round(found.share, 4), pair),
            "reached": found.reached,
            "with_the_same_number": found.same_number,
            "smallest": found.smallest,
            "largest": found.largest,
        }
        if law == "elastic_plastic":
            entry |= {"stiffness_factor": STIFFNESS_FACTOR, "damping_ratio": DAMPING_RATIO}
        for scale, against in (("coarse", own), ("full", validated)):
            angles = runs[runs["scale"] == scale]["response"]
            if len(angles):
                entry[scale] = _agreement(angles, against, margin)
        out["laws"][law] = entry
    return out


def _agreement(angles, against, margin):
    """Runs of the other law beside runs of the calibrated one on the same scale."""
    c = compare([list(angles)], list(against), margin)
    return {
        "mean": c.simulated_mean,
        "sd": c.simulated_sd,
        "runs": c.simulated_n,
        "calibrated_law_mean": c.measured_mean,
        "calibrated_law_sd": c.measured_sd,
        "calibrated_law_runs": c.measured_n,
        "difference": c.difference,
        "difference_interval_95": [c.difference_low, c.difference_high],
    }
