"""The paper's tilted plane and drop as virtual experiments.

Both follow the paper: a sweep of the parameter, a quadratic fit (Eqs. 21, 23), its inverse for the measured value, and
runs that confirm it.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from calibration import figures
from calibration.campaign import plan, read_metric, write_plan
from calibration.config import bench_run, given, point_spec
from calibration.errors import CalibrationError
from calibration.factors import factor_of, read_factors
from calibration.files import write_table
from dem.io.files import write_json
from dem.spec import parse_spec


@dataclass(frozen=True)
class Sweep:
    """A bench test that calibrates the factor of one key of the run spec; `repeats` is the geometry key of the repeats
    within a run."""

    key: str
    metric: str
    spread: str
    repeats: str
    unit: str
    axis: str


SWEEPS = {
    "tilt": Sweep(
        "contacts.particle_wall.static_friction", "sliding_angle_deg", "sliding_angle_sd_deg", "trials", "deg",
        "sliding angle [°]",
    ),
    "drop": Sweep(
        "contacts.particle_wall.restitution", "rebound_height_mm", "rebound_height_sd_mm", "drops", "mm",
        "rebound height [mm]",
    ),
}  # fmt: skip


def bench_config(config, test):
    """The configuration with the bench test's own run spec: the study's materials and laws, its own grains and rig."""
    return config.model_copy(
        update={"run": bench_run(config, given(config, f"bench.{test}", test).run)}
    )


def swept(config, test):
    """Name of the factor that a test calibrates. Raises ConfigError for a study without it."""
    return factor_of(read_factors(config.factors), SWEEPS[test].key).name


def plan_sweep(config, test, folder):
    """Plan a run at each level of the sweep."""
    levels = given(config, f"bench.{test}", test).levels
    _plan(config, test, {"run": range(1, len(levels) + 1), swept(config, test): levels}, folder)


def _plan(config, test, columns, folder):
    factors = read_factors(config.factors)
    write_plan(folder, *plan(pd.DataFrame(columns), factors, bench_config(config, test), test))


def inverse_of(coefficients, target, low, high):
    """The level in [low, high] at which a quadratic (highest power first) has the value `target`.

    Of two such levels the one where the quadratic runs as it does from end to end: the other lies beyond a turn that
    is the fit's alone. Raises CalibrationError when there is none.
    """
    roots = np.roots(np.asarray(coefficients, float) - [0.0, 0.0, target])
    inside = [
        float(r.real) for r in roots if abs(r.imag) < 1e-9 and low - 1e-9 <= r.real <= high + 1e-9
    ]
    if not inside:
        raise CalibrationError(f"no level between {low:g} and {high:g} gives {target:g}")
    rise = np.polyval(coefficients, high) - np.polyval(coefficients, low)
    return max(inside, key=lambda level: rise * np.polyval(np.polyder(coefficients), level))


def fit_sweep(config, test, design_file):
    """Runs with their `response`, coefficients of the quadratic (highest power first), its R2, and the level that gives
    the measured value. Raises CalibrationError where no swept level does."""
    sweep, section = SWEEPS[test], getattr(config.bench, test)
    runs = pd.read_csv(design_file)
    runs["response"] = read_metric(runs["run_id"], sweep.metric)
    x, y = runs[swept(config, test)].to_numpy(float), runs["response"].to_numpy(float)
    coefficients = np.polyfit(x, y, 2)
    residual = y - np.polyval(coefficients, x)
    r2 = 1.0 - float(residual @ residual) / float(((y - y.mean()) ** 2).sum())
    return runs, coefficients, r2, inverse_of(coefficients, section.measured, x.min(), x.max())


def plan_confirmation(config, test, design_file, folder):
    """Plan replicates at the inverse."""
    _, _, _, level = fit_sweep(config, test, design_file)
    runs = range(1, getattr(config.bench, test).confirmations + 1)
    _plan(config, test, {"run": runs, swept(config, test): round(level, 6)}, folder)


def analyse_sweep(config, test, sweep_file, confirm_file, output):
    """Fit, inverse, confirmation, and the closed form beside them."""
    sweep, section, factor = SWEEPS[test], getattr(config.bench, test), swept(config, test)
    runs, coefficients, r2, level = fit_sweep(config, test, sweep_file)
    runs["response_sd"] = read_metric(runs["run_id"], sweep.spread)
    spec = parse_spec(point_spec(bench_config(config, test).run, test, {}, config.seed))
    runs["repeats"] = getattr(spec.geometry, sweep.repeats)
    confirm = pd.read_csv(confirm_file)
    confirmed = np.array(read_metric(confirm["run_id"], sweep.metric))
    write_table(runs, output.runs)
    figure = figures.sweep(
        runs[factor], runs["response"], coefficients, level, section.measured, factor, sweep.axis
    )
    figures.save(figure, output.figure)
    write_json(
        output.summary,
        {
            "factor": factor,
            "measured": section.measured,
            "unit": sweep.unit,
            "quadratic": [float(c) for c in coefficients],
            "R2": r2,
            "inverse": level,
            "confirmed_n": len(confirmed),
            "confirmed_mean": float(confirmed.mean()),
            "confirmed_sd": float(confirmed.std(ddof=1)) if len(confirmed) > 1 else 0.0,
            "relative_error_percent": 100.0
            * abs(float(confirmed.mean()) - section.measured)
            / section.measured,
            "closed_form": closed_form(test, section.measured, spec.geometry),
            "closed_form_of": "tan(angle)" if test == "tilt" else "sqrt(rebound / drop height)",
        },
    )


def closed_form(test, measured, geometry):
    """The parameter by the physics of the test: tan of the sliding angle [deg], or sqrt(h/H) of the rebound [mm] from
    the drop height of the run spec's geometry."""
    if test == "tilt":
        return float(np.tan(np.radians(measured)))
    return float(np.sqrt(measured / geometry.drop_height_mm))


def calibrated(*files):
    """{factor: level} that the bench tests found, for the heap's fixed parameters; a test without a level adds none."""
    found = (json.loads(Path(p).read_text()) for p in files)
    return {f["factor"]: round(f["inverse"], 4) for f in found if f["inverse"] is not None}
