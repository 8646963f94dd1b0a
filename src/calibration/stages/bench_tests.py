"""Tilted plane and drop as virtual bench tests.

Each is a sweep of one parameter, a quadratic fit, its inverse for the measured value, and runs that
confirm it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain.handed_over import NamedFiles
from calibration.chain.study import Study
from calibration.errors import CalibrationError, ConfigError
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_metric, write_plan
from calibration.stages import worded
from calibration.study.config import point_spec, read_swept
from calibration.study.config.tests import SWEPT, is_swept, sweep_of, swept_test
from calibration.study.factors import factor_of
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of


@dataclass(frozen=True)
class Sweep:
    """What a bench test that calibrates a factor measures; `repeats` is the geometry key of the
    repeats within a run."""

    metric: str
    spread: str
    repeats: str


SWEEPS = {
    "tilt": Sweep("sliding_angle_deg", "sliding_angle_sd_deg", "trials"),
    "drop": Sweep("rebound_height_mm", "rebound_height_sd_mm", "drops"),
}


def swept(study: Study, test: str) -> str:
    """Name of the factor that a test calibrates. Raises ConfigError for a study without it."""
    return factor_of(study.factors, SWEPT[test]).name


def measured(study: Study, test: str) -> float:
    """The measured value that a test's sweep is inverted at, of its rig. Raises ConfigError for
    none, or for several."""
    found = read_swept(study.config, swept_test(study.config, test), SWEEPS[test].metric)
    if len(found) > 1:
        raise ConfigError(
            f"holds several conditions that the bench test {test} is at",
            path=study.config.measurements,
            value=", ".join(f"line {m.line}" for m in found),
            allowed="one; levers tell them apart",
        )
    return found[0].value


def plan_sweep(test: str, study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan a run at each level of the sweep."""
    points = _levels(study.config, study.factors, test)
    write_plan(output.plan, *study.plan_points(points))


def _levels(config, factors, test):
    """`Points` of the levels of a test's sweep. Raises ConfigError for a study without it."""
    name, levels = swept_test(config, test), sweep_of(config, test).levels
    factor = factor_of(factors, SWEPT[test]).name
    design = pd.DataFrame({"run": range(1, len(levels) + 1), factor: levels})
    return [Points(f"tests.{name}.sweep", design, test, config.run_of(name))]


def _ahead(test, config, factors):
    """The levels of a test's sweep, none of a study without it."""
    return _levels(config, factors, test) if is_swept(config, factors, test) else []


def inverse_of(coefficients: np.ndarray, target: float, low: float, high: float) -> float:
    """The level in [low, high] at which a quadratic (highest power first) has the value `target`.

    Of two such levels the one where the quadratic runs as it does from end to end: the other lies
    beyond a turn that is the fit's alone. Raises CalibrationError when there is none. coefficients:
    (3,).
    """
    roots = np.roots(np.asarray(coefficients, float) - [0.0, 0.0, target])
    inside = [
        float(r.real) for r in roots if abs(r.imag) < 1e-9 and low - 1e-9 <= r.real <= high + 1e-9
    ]
    if not inside:
        raise CalibrationError(f"no level between {low:g} and {high:g} gives {target:g}")
    rise = np.polyval(coefficients, high) - np.polyval(coefficients, low)
    return max(inside, key=lambda level: rise * np.polyval(np.polyder(coefficients), level))


def fit_sweep(
    study: Study, test: str, design_file: str | Path
) -> tuple[pd.DataFrame, np.ndarray, float, float]:
    """Runs with their `response`, coefficients of the quadratic (highest power first), its R2, and
    the level that gives the measured value. Raises CalibrationError where no swept level does. The
    coefficients are (3,)."""
    sweep = SWEEPS[test]
    runs = read_written(design_file)
    runs["response"] = read_metric(runs["run_id"], sweep.metric)
    x, y = runs[swept(study, test)].to_numpy(float), runs["response"].to_numpy(float)
    coefficients = np.polyfit(x, y, 2)
    residual = y - np.polyval(coefficients, x)
    r2 = 1.0 - float(residual @ residual) / float(((y - y.mean()) ** 2).sum())
    return runs, coefficients, r2, inverse_of(coefficients, measured(study, test), x.min(), x.max())


def plan_confirmation(test: str, study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan replicates at the inverse."""
    _, _, _, level = fit_sweep(study, test, source.sweep)
    config = study.config
    runs = range(1, sweep_of(config, test).confirmations + 1)
    columns = {"run": runs, swept(study, test): round(level, 6)}
    run = config.run_of(swept_test(config, test))
    write_plan(output.plan, *study.plan(pd.DataFrame(columns), test, run))


def analyse_sweep(test: str, study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Fit, inverse, confirmation, and the closed form beside them."""
    config, sweep, factor = study.config, SWEEPS[test], swept(study, test)
    value = measured(study, test)
    runs, coefficients, r2, level = fit_sweep(study, test, source.sweep)
    runs["response_sd"] = read_metric(runs["run_id"], sweep.spread)
    spec = parse_spec(point_spec(config.run_of(swept_test(config, test)), test, {}, config.seed))
    runs["repeats"] = getattr(spec.geometry, sweep.repeats)
    confirm = read_written(source.confirmation)
    confirmed = np.array(read_metric(confirm["run_id"], sweep.metric))
    write_table(runs, output.runs)
    axis = figures.response_of(sweep.metric).axis
    figure = sweep_figure(runs[factor], runs["response"], coefficients, level, value, factor, axis)
    figures.save(figure, output.figure)
    write_json(
        output.summary,
        {
            "factor": factor,
            "measured": value,
            "unit": in_ascii(unit_of(sweep.metric)),
            "quadratic": [float(c) for c in coefficients],
            "R2": r2,
            "inverse": level,
            "confirmed_n": len(confirmed),
            "confirmed_mean": float(confirmed.mean()),
            "confirmed_sd": float(confirmed.std(ddof=1)) if len(confirmed) > 1 else 0.0,
            "relative_error_percent": 100.0 * abs(float(confirmed.mean()) - value) / value,
            "closed_form": closed_form(test, value, spec.geometry),
            "closed_form_of": "tan(angle)" if test == "tilt" else "sqrt(rebound / drop height)",
        },
    )


def closed_form(test: str, measured: float, geometry: Any) -> float:
    """The parameter by the physics of the test: tan of the sliding angle [deg], or sqrt(h/H) of the
    rebound [mm] from the drop height of the run spec's geometry."""
    if test == "tilt":
        return float(np.tan(np.radians(measured)))
    return float(np.sqrt(measured / geometry.drop_height_mm))


def bench_parameters(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write {factor: level} that the bench tests found, for the heap's fixed parameters; a test
    without a level adds none."""
    found = [read_json(path) for path in (source.tilt, source.drop, source.shear)]
    levels = {f["factor"]: round(f["inverse"], 4) for f in found if f["inverse"] is not None}
    write_json(output.fixed, {"fixed": levels})


# as the workflow calls them
plan_tilt, plan_drop = partial(plan_sweep, "tilt"), partial(plan_sweep, "drop")
plan_tilt_confirmation = partial(plan_confirmation, "tilt")
plan_drop_confirmation = partial(plan_confirmation, "drop")
tilt, drop = partial(analyse_sweep, "tilt"), partial(analyse_sweep, "drop")


def sweep_figure(
    levels: Sequence[float] | np.ndarray | pd.Series,
    response: Sequence[float] | np.ndarray | pd.Series,
    coefficients: np.ndarray,
    inverse: float,
    measured: float,
    factor: str,
    axis: str,
) -> figures.Drawing:
    """Sweep of a bench test with its quadratic and the inverse of the measured value; axis: label
    of the response. levels, response: (n,); coefficients: (3,), the highest power first."""
    figure, ax = figures.subplots()
    x = np.linspace(min(levels), max(levels), 101)
    ax.plot(x, np.polyval(coefficients, x), color=figures.GREY, label="quadratic fit")
    ax.scatter(levels, response, color=figures.BLUE, zorder=3, label="simulated")
    ax.hlines(measured, min(levels), inverse, color=figures.ORANGE, lw=1.2)
    ax.vlines(
        inverse,
        0,
        measured,
        color=figures.ORANGE,
        lw=1.2,
        label=f"measured {measured:g}: {inverse:.3f}",
    )
    ax.set(xlabel=figures.label(factor), ylabel=axis, ylim=(0, 1.05 * max(response)))
    # above the axes: the line of the measured value may run anywhere within
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=9)
    return figure


STAGES = (
    *(
        Stage(
            name=test,
            title=title,
            place=place,
            plans=(
                Plan(test, partial(_ahead, test), batches),
                Plan(f"{test}_confirmation", batches=1),
            ),
            figures=(Figure(test, ("runs.csv",)),),
            tables=(("runs", "Runs"),),
            sentences=worded("bench"),
        )
        for test, title, place, batches in (
            ("tilt", "Bench test: tilted plane", 7.1, 2),
            ("drop", "Bench test: drop", 7.2, 1),
        )
    ),
    Stage(name="bench", title="What the bench tests found", place=7.4, made_by="bench_parameters"),
)
