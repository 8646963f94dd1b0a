"""The calibrated angle in codes with other laws of rolling friction: which numbers give it there.

The law calibrated with (usually EDEM's constant torque on each grain's own spin) is missing from
most codes. Theirs act on the relative spin of two grains. With the same number, or with the number
that makes the torques equal, their heaps are flatter by about ten degrees, because grains that turn
together feel nothing. No formula converts one coefficient into the other. The angle is therefore
measured with this engine, which has both kinds of law.

Two paths are searched. Everything else stays as it is.

elastic_plastic
    The rolling friction of grain on grain rises in that law, from less than the calibrated number
    to so much that grains slide before they roll. Torsion goes with it.
no_rotation
    Grains do not turn at all, and the static friction of grain on grain rises to the calibrated
    number. Every code can do this, and it means the same in each. Here it is `constant_torque` with
    more rolling friction than static.

The angle along a path is made monotone and inverted for the angle that the calibrated law gives.
The first path that reaches this angle is taken. The first path does not reach the angle of a steep
heap: grains that cannot roll on each other still slide, twist and turn together. Runs at the point
found confirm it. If no path reaches the angle, the exports take the smallest number of the first
path that is as good as its best, and they say what is missing.

All paths are run with fewer, larger grains of the same total volume in the same rig (MOST_GRAINS).
The confirmation is also run at the study's own scale. A law does not grow with the scale as another
does, so that the number of large grains can miss the angle there. It is then moved once, along the
path, by what is missing, and more runs at the study's own scale say what became of it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from calibration.chain.study import NamedFiles
from calibration.engines.conversion import (
    DAMPING_RATIO,
    ELASTIC_PLASTIC,
    NO_ROTATION,
    STIFFNESS_FACTOR,
    needs_search,
)
from calibration.errors import CalibrationError
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, run_id, together, write_plan
from calibration.statistics.equivalence import compare
from calibration.study.config import overlay
from dem.errors import SpecError
from dem.spec import ContactSpec, RunSpec, parse_spec

PATHS = {
    ELASTIC_PLASTIC: (-0.25, 0.0, 0.3333, 0.6667, 1.0),
    NO_ROTATION: (0.25, 0.4, 0.6, 0.8, 1.0),
}
"""Path -> places on it, see `place`. `constant_torque_relative` is none of them: LIGGGHTS' `cdt`
does not stop at a reversal of the spin, and its heaps are flatter than ours."""
CALIBRATED = "calibrated"
COLUMNS = ["path", "scale", "share", "rolling_friction", "static_friction", "seed", "run_id"]
MOST_ROLLING = 5.0  # what a run spec allows
OWN_SEEDS, PATH_SEEDS, CONFIRM_SEEDS, FULL_SEEDS = 6, 3, 5, 5
MOST_GRAINS = 2500


def place(path: str, share: float, pair: ContactSpec) -> tuple[float, float]:
    """(rolling friction, static friction) of grain on grain at a place of a path, from the
    calibrated contact (`ContactSpec`).

    elastic_plastic: 0 is the calibrated number, 1 the top, with equal ratios between. The top is 2
    mu_s. The limit mu_r R* F_n is then mu_s R F_n for equal grains, the largest torque of sliding
    friction on a grain. A larger number changes nothing. no_rotation: the share of the calibrated
    static friction. Rounded, as levels name cached runs.
    """
    mu, static = pair.rolling_friction, pair.static_friction
    if path == NO_ROTATION:
        return MOST_ROLLING, round(share * static, 6)
    top = min(2.0 * max(static, mu), MOST_ROLLING)
    return round(min(mu * (top / mu) ** share, MOST_ROLLING), 6), static


def coarse(spec: dict[str, Any]) -> dict[str, Any]:
    """A heap's run spec (a mapping) with at most MOST_GRAINS larger grains of the same total
    volume. It is unchanged if these would not pass the funnel."""
    parsed = parse_spec(spec)
    if parsed.particles.count <= MOST_GRAINS:
        return spec
    ratio = parsed.particles.count / MOST_GRAINS
    scale = round(parsed.particles.scale_factor * ratio ** (1 / 3), 6)
    rate = parsed.geometry.generation_rate_per_s / ratio
    grains = {"count": MOST_GRAINS, "scale_factor": scale}
    larger = overlay(spec, {"particles": grains, "geometry": {"generation_rate_per_s": rate}})
    try:
        parse_spec(larger)
    except SpecError:
        return spec
    return larger


def on_path(spec: dict[str, Any], path: str, share: float) -> dict[str, Any]:
    """The run spec (a mapping) of the calibrated point moved to a place of a path."""
    rolling, static = place(path, share, parse_spec(spec).contacts.particle_particle)
    changes = {
        "laws": {"rolling": "constant_torque"},
        "contacts": {"particle_particle": {"rolling_friction": rolling, "static_friction": static}},
    }
    if path == NO_ROTATION:
        changes["contacts"]["particle_wall"] = {"rolling_friction": rolling}  # type: ignore[index]
    else:
        # with torsion: grains that spin about the normal of their contact would never come to rest
        changes["laws"] = {"rolling": path, "torsion": "marshall"}
        changes["law_parameters"] = {
            "rolling_stiffness_factor": STIFFNESS_FACTOR,
            "rolling_damping_ratio": DAMPING_RATIO,
        }
    given = spec.get("law_parameters", {})
    kept = {key: value for key, value in given.items() if not key.startswith("rolling_")}
    return overlay(spec | {"law_parameters": kept}, changes)


def rows_at(
    base: dict[str, Any], path: str | None, share: float, seeds: int, scale: str
) -> tuple[pd.DataFrame, dict[str, dict[str, Any]]]:
    """Design rows and {run_id: spec} of runs at one place; path None: as calibrated."""
    moved = base if path is None else on_path(base, path, share)
    pair = parse_spec(moved).contacts.particle_particle
    specs = [overlay(moved, {"seed": base["seed"] + n}) for n in range(seeds)]
    named = {run_id(spec): spec for spec in specs}
    at = path or CALIBRATED, scale, share, pair.rolling_friction, pair.static_friction
    rows = [(*at, spec["seed"], name) for name, spec in named.items()]
    return pd.DataFrame(rows, columns=COLUMNS), named


def _write(parts, output):
    none = pd.DataFrame(columns=COLUMNS), {}
    write_plan(output.plan, *(together(parts) if parts else none))


def plan_scan(spec: dict[str, Any], output: NamedFiles) -> None:
    """Plan runs of the calibrated law and along each path; spec: calibrated run spec (a
    mapping)."""
    parts = []
    if needs_search(parse_spec(spec)):
        base = coarse(spec)
        parts.append(rows_at(base, None, 0.0, OWN_SEEDS, "coarse"))
        for path, share in ((path, share) for path, shares in PATHS.items() for share in shares):
            parts.append(rows_at(base, path, share, PATH_SEEDS, "coarse"))
    _write(parts, output)


def read_scan(design_file: str | Path, metric: str) -> pd.DataFrame:
    """The design table with the runs' angles in `response`, NaN of a run without one."""
    design = read_written(design_file)
    return design.assign(response=read_values(design["run_id"], metric))


@dataclass(frozen=True)
class Inverse:
    """Where on a path the angle is: share, and the range that the scan came to [unit of the
    angle]."""

    share: float
    reached: bool
    smallest: float
    largest: float


def invert(shares: ArrayLike, angles: ArrayLike, target: float) -> Inverse:
    """`Inverse` of angles (n,) at shares (n,) for a target angle.

    The means at each share are made monotone (running maximum) and interpolated linearly. Below the
    path's range its start is returned. Above the range the first share is returned whose mean is
    within a standard error of the largest. `reached` is then False.
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
    return Inverse(float(share), reached, float(y[0]), float(y[-1]))


def angles_of(runs: pd.DataFrame, path: str) -> pd.Series:
    """(n,) responses of a path's runs that have one."""
    return runs[runs["path"] == path]["response"].dropna()


def _inverse(scan, path, target):
    """`Inverse` of a path's runs for a target angle."""
    angles = angles_of(scan, path)
    return invert(scan.loc[angles.index, "share"], angles, target)


def search(scan: pd.DataFrame) -> tuple[str | None, dict[str, Inverse]]:
    """(path taken, {path: Inverse}) of a scan (table with `response`); (None, {}) of an empty one.
    Raises CalibrationError where no heap of the calibrated law, or of a path, has an angle."""
    if scan.empty:
        return None, {}
    for path in (CALIBRATED, *PATHS):
        if angles_of(scan, path).empty:
            raise CalibrationError(
                f"no heap of the search for rolling friction in other laws has an angle ({path}): "
                "its funnel clogs or its grains never rest; widen the orifice of the study's rig"
            )
    own = angles_of(scan, CALIBRATED).mean()
    found = {path: _inverse(scan, path, own) for path in PATHS}
    return next((path for path in PATHS if found[path].reached), ELASTIC_PLASTIC), found


def plan_confirmation(spec: dict[str, Any], scan: pd.DataFrame, output: NamedFiles) -> None:
    """Plan runs at the point found, on the scan's scale and on the study's own."""
    parts = []
    path, found = search(scan)
    if path:
        base, share = coarse(spec), round(found[path].share, 4)
        parts.append(rows_at(base, path, share, CONFIRM_SEEDS, "coarse"))
        if base is not spec:
            parts.append(rows_at(spec, path, share, FULL_SEEDS, "full"))
    _write(parts, output)


@dataclass(frozen=True)
class Evidence:
    """Runs of a search: tables with `response`, NaN of a run without a value."""

    scan: pd.DataFrame
    confirmation: pd.DataFrame
    validated: pd.Series
    """(n,) angles of the calibrated law at the study's own scale."""
    margin: float
    """Difference that does not matter."""

    def checks(self, runs: pd.DataFrame) -> dict[str, dict[str, Any]]:
        """{scale: how the runs there at the number found agree with the calibrated law's}."""
        found = {}
        own = {"coarse": angles_of(self.scan, CALIBRATED), "full": self.validated.dropna()}
        for scale, against in own.items():
            angles = runs[runs["scale"] == scale]["response"].dropna()
            if min(len(angles), len(against)) > 1:
                found[scale] = _agreement(angles, against, self.margin)
        return found


def plan_correction(spec: dict[str, Any], evidence: Evidence, output: NamedFiles) -> None:
    """Plan runs at a number moved by what the number found misses at the study's own scale; none
    where that is within the margin, or where its 95 % interval holds zero.

    spec: calibrated run spec (a mapping)."""
    parts = []
    path, found = search(evidence.scan)
    scale = "coarse" if coarse(spec) is spec else "full"
    check = evidence.checks(evidence.confirmation).get(scale)
    if path and check and found[path].reached:
        (low, high), difference = check["difference_interval_95"], check["difference"]
        if abs(difference) > evidence.margin and not low <= 0.0 <= high:
            wanted = angles_of(evidence.scan, CALIBRATED).mean() - difference
            moved = round(_inverse(evidence.scan, path, wanted).share, 4)
            parts.append(rows_at(spec, path, moved, FULL_SEEDS, scale))
    _write(parts, output)


def conclude(
    spec: RunSpec, evidence: Evidence, correction: pd.DataFrame, unit: str
) -> dict[str, Any]:
    """The conversion as a mapping for rolling.json. spec: calibrated `RunSpec`; correction: table
    of the runs at the number that was moved, empty where it was not; unit: of the angle."""
    scan, moved = evidence.scan, not correction.empty
    pair, (path, found) = spec.contacts.particle_particle, search(scan)
    out = {"law": spec.laws.rolling, "unit": unit, "path": path}  # type: ignore[attr-defined]  # a field for each law
    if path is None:
        return out
    searched = _numbers(path, round(found[path].share, 4), pair)
    same = angles_of(scan[scan["share"] == 0.0], ELASTIC_PLASTIC)
    responses = pd.concat([runs["response"] for runs in (scan, evidence.confirmation, correction)])
    taken = _numbers(path, correction["share"].iloc[0], pair) if moved else searched
    out |= taken | {
        "stiffness_factor": STIFFNESS_FACTOR,
        "damping_ratio": DAMPING_RATIO,
        "reached": found[path].reached,
        "with_the_same_number": None if same.empty else float(same.mean()),
        "ranges": {name: [inverse.smallest, inverse.largest] for name, inverse in found.items()},
        "runs": len(responses),
        "without_value": int(responses.isna().sum()),
    }
    checks = evidence.checks(evidence.confirmation)
    if moved:
        return out | {"searched": searched | checks} | evidence.checks(correction)
    return out | checks


def _numbers(path, share, pair):
    rolling, static = place(path, share, pair)
    return {"rolling_friction": rolling, "static_friction": static}


def _agreement(angles, against, margin):
    """Runs at the point found beside runs of the calibrated law on the same scale."""
    c = compare(angles, against, margin)
    return {
        "mean": c["simulated_mean"],
        "sd": c["simulated_sd"],
        "runs": c["simulated_n"],
        "calibrated_law_mean": c["measured_mean"],
        "calibrated_law_sd": c["measured_sd"],
        "calibrated_law_runs": c["measured_n"],
        "difference": c["difference"],
        "difference_interval_95": [c["difference_low"], c["difference_high"]],
    }
