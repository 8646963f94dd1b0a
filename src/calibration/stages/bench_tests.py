"""Virtual bench tests: tilted plane, drop and direct shear.

Tilted plane and drop are each a sweep of one parameter, a quadratic fit, its inverse for the
measured value, and runs that confirm it.

The direct shear gives yield loci at several particle frictions. The slope of a yield locus is
sometimes taken for the friction between two particles. The slope is a property of the bulk:
particle friction, rolling resistance and dilation make it. So the particle friction is swept here,
as the tilt test sweeps it, and the friction whose locus has the measured slope is read off with its
interval.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike

from calibration import figures
from calibration.chain.responses import spread_of
from calibration.chain.study import NamedFiles, Study
from calibration.errors import CalibrationError, ConfigError
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_metric, together, write_plan
from calibration.stages import worded
from calibration.statistics.numbers import fixed
from calibration.study.config import Config, overlay, point_spec, read_swept
from calibration.study.config.tests import SHEAR, SWEPT, is_swept, sweep_of, swept_test
from calibration.study.factors import factor_of
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of

METRICS = {"peak": "shear_stress_kPa", "steady": "steady_shear_stress_kPa"}
MEASURE = "peak"  # the bench reads the peak of each shear after pre-shear
GRID = 1001
LOAD = "normal_stress_kPa"
DIGITS = 12
"""Decimals of a measured line: points that were written down from a printed one give it back."""


def measured_locus(config: Config) -> tuple[float, float]:
    """(slope, intercept [kPa]) of the least-squares line through the measured shear stresses.
    Raises ConfigError for fewer than two loads."""
    found = read_swept(config, swept_test(config, "shear"), METRICS[MEASURE], (LOAD,))
    loads = [m.levers[LOAD] for m in found]
    if len(set(loads)) < 2:
        raise ConfigError(
            "has one load, through which no yield locus can be drawn", path=config.measurements,
            line=found[0].line, column=LOAD, value=loads[0],
            allowed="shear stresses at two normal stresses or more",
        )  # fmt: skip
    line = scipy.stats.linregress(loads, [m.value for m in found])
    return round(float(line.slope), DIGITS), round(float(line.intercept), DIGITS)


def plan_shear(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan replicates at each particle friction and normal stress; each cell of the design has its
    own seeds."""
    first_seed, parts = study.config.seed, []
    for cell in _cells(study.config, study.factors):
        table, specs = study.plan(cell.design, cell.experiment, cell.run, first_seed)
        stress = cell.run["geometry"][LOAD]
        parts.append((table.assign(normal_stress_kPa=stress), specs))
        first_seed += len(cell.design)
    write_plan(output.plan, *together(parts))


def _cells(config, factors):
    """`Points` of each particle friction and normal stress. Raises ConfigError for a study without
    the test."""
    name, section = swept_test(config, "shear"), sweep_of(config, "shear")
    base, factor = config.run_of(name), factor_of(factors, SWEPT[SHEAR]).name
    held = {n: v for n, v in config.tests[name].fixed.items() if n != factor}
    for level, stress in product(section.levels, section.normal_stresses_kPa):
        run = overlay(base, {"geometry": {LOAD: stress}})
        rows = pd.DataFrame({"replicate": range(1, section.replicates + 1), factor: level})
        yield Points(f"tests.{name}.sweep", rows.assign(**held), "shear", run)


def yield_locus(normal: np.ndarray | pd.Series, shear: np.ndarray | pd.Series) -> dict[str, Any]:
    """Straight line shear = slope * normal + intercept through stresses (n,) [kPa], with intervals
    and the p of a zero intercept, for JSON."""
    fit = scipy.stats.linregress(normal, shear)
    t = scipy.stats.t.ppf(0.975, len(normal) - 2)
    zero = 2 * scipy.stats.t.sf(abs(fit.intercept / fit.intercept_stderr), len(normal) - 2)
    return {
        "slope": float(fit.slope),
        "slope_interval": [float(fit.slope - t * fit.stderr), float(fit.slope + t * fit.stderr)],
        "intercept_kPa": float(fit.intercept),
        "intercept_interval_kPa": [
            float(fit.intercept - t * fit.intercept_stderr),
            float(fit.intercept + t * fit.intercept_stderr),
        ],
        "p_zero_intercept": float(zero),
        "R2": float(fit.rvalue**2),
    }


class SlopeCurve:
    """Slope of the yield locus as a quadratic of the particle friction, fitted to all runs at once.

    shear = normal (b0 + b1 mu + b2 mu2) + c0 + c1 mu, each run weighted by 1/normal: the scatter of
    a shear stress grows with its load.
    """

    def __init__(self, friction: ArrayLike, normal: ArrayLike, shear: ArrayLike) -> None:
        """Fit runs (n,) of particle friction [-], normal and shear stress [kPa]."""
        mu, sigma, tau = (np.asarray(a, float) for a in (friction, normal, shear))
        model = np.column_stack([np.ones_like(mu), mu, mu**2, 1.0 / sigma, mu / sigma])
        response = tau / sigma
        self.coefficients, *_ = np.linalg.lstsq(model, response, rcond=None)
        left = response - model @ self.coefficients
        freedom = len(mu) - model.shape[1]
        self.covariance = float(left @ left) / freedom * np.linalg.inv(model.T @ model)
        self.t = float(scipy.stats.t.ppf(0.975, freedom))
        self.low, self.high = mu.min(), mu.max()

    def at(self, friction: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Slope and half width of its interval at frictions (m,)."""
        mu = np.asarray(friction, float)
        model = np.stack([np.ones_like(mu), mu, mu**2], axis=-1)
        variance = np.einsum("...i,ij,...j->...", model, self.covariance[:3, :3], model)
        return model @ self.coefficients[:3], self.t * np.sqrt(variance)

    def inverse(self, slope: float) -> tuple[float, list[float]] | tuple[None, None]:
        """(friction, interval) within the swept range that give the slope; (None, None) where none
        does.

        The interval holds every friction whose slope's interval covers `slope` (Fieller's
        construction). The friction is where the curve first has the slope, or comes nearest to it
        without leaving its own interval.
        """
        mu = np.linspace(self.low, self.high, GRID)
        value, half = self.at(mu)
        covered = mu[np.abs(value - slope) <= half]
        crossing = np.flatnonzero(np.diff(np.sign(value - slope)) != 0)
        if len(crossing):
            k = crossing[0]
            friction = mu[k] + (slope - value[k]) / (value[k + 1] - value[k]) * (mu[k + 1] - mu[k])
        elif len(covered):
            friction = mu[np.argmin(np.abs(value - slope))]
        else:
            return None, None
        ends = [*covered, friction]
        return float(friction), [float(min(ends)), float(max(ends))]


def shear(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Yield loci at each friction, the slope over the friction, and what follows for the
    friction."""
    config, runs = study.config, read_written(source.design)
    measured, factor = measured_locus(config), factor_of(study.factors, SWEPT[SHEAR]).name
    for name, metric in METRICS.items():
        runs[f"{name}_kPa"] = read_metric(runs["run_id"], metric)
    loci = [
        {"particle_friction": float(level)}
        | {n: yield_locus(g["normal_stress_kPa"], g[f"{n}_kPa"]) for n in METRICS}
        for level, g in runs.groupby(factor)
    ]
    curves = {
        n: SlopeCurve(runs[factor], runs["normal_stress_kPa"], runs[f"{n}_kPa"]) for n in METRICS
    }
    used = config.fixed.get(factor)
    judged = {n: _judge(curve, used, measured[0]) for n, curve in curves.items()}
    write_table(runs, output.runs)
    drawn = runs.rename(columns={factor: "particle_friction"})
    figures.save(yield_loci(drawn, loci, curves, MEASURE, measured), output.figure)
    write_json(
        output.summary,
        {
            "factor": factor,
            "measure": MEASURE,
            "measured": {"slope": measured[0], "intercept_kPa": measured[1]},
            "inverse": judged[MEASURE]["inverse"],
            "loci": loci,
            **judged,
            "sentence": worded("locus")(judged[MEASURE], measured[0])[0],
        },
    )


def _judge(curve, used, measured):
    """The slope at the friction in use (the highest swept unless given), the friction for the
    measured slope, and whether the slope can be taken for the friction."""
    used = curve.high if used is None else used
    slope, half = (float(x) for x in curve.at(used))
    friction, interval = curve.inverse(measured)
    return {
        "particle_friction": used,
        "slope": slope,
        "slope_interval": [slope - half, slope + half],
        "inverse": friction,
        "inverse_interval": interval,
        "swept": [curve.low, curve.high],
        "bulk_slope_equals_particle_friction": bool(abs(slope - used) <= half),
        "measured_slope_within_interval": bool(abs(slope - measured) <= half),
    }


def yield_loci(
    runs: pd.DataFrame,
    loci: Sequence[Mapping[str, Any]],
    curves: Mapping[str, Any],
    measure: str,
    measured: tuple[float, float],
) -> figures.Drawing:
    """Yield loci at each particle friction, and the slope over the friction with its interval,
    beside the measured.

    runs: columns particle_friction, normal_stress_kPa and, for each measure, <measure>_kPa;
    measured: slope and intercept [kPa].
    """
    figure, (left, right) = figures.subplots(1, 2, (9.6, 4.2))
    end = 1.05 * runs["normal_stress_kPa"].max()
    x = np.array([0.0, end])
    for locus in loci:
        friction, line = locus["particle_friction"], locus[measure]
        points = runs[runs["particle_friction"] == friction]
        text = f"µ {friction:g}: {fixed(line['slope'], 2)} x {fixed(line['intercept_kPa'], 2, '+')}"
        (drawn,) = left.plot(x, line["slope"] * x + line["intercept_kPa"], label=text)
        left.scatter(
            points["normal_stress_kPa"], points[f"{measure}_kPa"], color=drawn.get_color(), s=18
        )
    slope, intercept = measured
    text = f"measured: {slope:g} x {intercept:+g}"
    left.plot(x, slope * x + intercept, color="black", ls="--", label=text)
    left.set(
        xlabel="normal stress [kPa]",
        ylabel=f"{measure} shear stress [kPa]",
        xlim=(0, None),
        ylim=(0, None),
    )
    left.legend(frameon=False, fontsize=8)
    for (name, curve), colour in zip(curves.items(), (figures.BLUE, figures.GREEN), strict=True):
        mu = np.linspace(curve.low, curve.high, 101)
        value, half = curve.at(mu)
        right.plot(mu, value, color=colour, label=name)
        right.fill_between(mu, value - half, value + half, color=colour, alpha=0.15, lw=0)
    right.axhline(slope, color="black", ls="--", lw=1, label=f"measured {slope:g}")
    right.plot(mu, mu, color=figures.GREY, ls=":", label="slope = particle friction")
    right.set(xlabel="particle friction", ylabel="slope of the yield locus")
    right.legend(frameon=False, fontsize=8)
    return figure


METRIC = {"tilt": "sliding_angle_deg", "drop": "rebound_height_mm"}
REPEATS = {"tilt": "trials", "drop": "drops"}
"""Geometry key of the repeats within a run of a test that calibrates a factor."""


def swept(study: Study, test: str) -> str:
    """Name of the factor that a test calibrates. Raises ConfigError for a study without it."""
    return factor_of(study.factors, SWEPT[test]).name


def measured(study: Study, test: str) -> float:
    """The measured value that a test's sweep is inverted at, of its rig. Raises ConfigError for
    none, or for several."""
    found = read_swept(study.config, swept_test(study.config, test), METRIC[test])
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
    if not is_swept(config, factors, test):
        return []
    return [*(_cells(config, factors) if test == SHEAR else _levels(config, factors, test))]


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
    runs = read_written(design_file)
    runs["response"] = read_metric(runs["run_id"], METRIC[test])
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
    config, metric, factor = study.config, METRIC[test], swept(study, test)
    value = measured(study, test)
    runs, coefficients, r2, level = fit_sweep(study, test, source.sweep)
    runs["response_sd"] = read_metric(runs["run_id"], spread_of(metric))
    spec = parse_spec(point_spec(config.run_of(swept_test(config, test)), test, {}, config.seed))
    runs["repeats"] = getattr(spec.geometry, REPEATS[test])
    confirm = read_written(source.confirmation)
    confirmed = np.array(read_metric(confirm["run_id"], metric))
    write_table(runs, output.runs)
    axis = figures.response_of(metric).axis
    figure = sweep_figure(runs[factor], runs["response"], coefficients, level, value, factor, axis)
    figures.save(figure, output.figure)
    write_json(
        output.summary,
        {
            "factor": factor,
            "measured": value,
            "unit": in_ascii(unit_of(metric)),
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
    Stage(
        name="shear",
        title="Bench test: direct shear",
        place=7.3,
        plans=(Plan("shear", partial(_ahead, SHEAR), 2),),
        figures=(Figure("yield_locus", ("runs.csv", "shear.json")),),
        tables=(("runs", "Runs"),),
        sentences=lambda summary, response: [summary["sentence"]],
    ),
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
