"""Response surface: a quadratic model of the region."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy

from calibration import figures
from calibration.chain.responses import naming_left_out, told, with_responses, with_value
from calibration.chain.study import NamedFiles, Study, read_region
from calibration.errors import CalibrationError
from calibration.figures import Drawing, Response, label_3d, plane
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import plan, write_plan
from calibration.stages import worded
from calibration.statistics.design import region_design
from calibration.statistics.factor import Factor
from calibration.statistics.surface import (
    Surface,
    fit_surface,
    outlier_limit,
    outliers,
    reduced_surface,
)
from calibration.study.factors import inside, physical_range
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json


def plan_response_surface(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the Box-Behnken design around the ascent's centre, or the configured one, and record its
    region."""
    config, factors, ascent = study.config, study.factors, read_json(source.ascent)
    varied = [f for f in factors if f.name in ascent["centre"]]
    centre = ascent["centre"] | config.response_surface.centre
    region = [_around(f, centre[f.name], config) for f in varied]
    design = region_design(region, config.response_surface)
    others = [f for f in factors if f not in varied]
    table, specs = plan(
        design, [*region, *others], config, config.experiment, config.own_run, study.seeds
    )
    write_plan(output.plan, table, specs)
    write_json(output.region, [vars(f) for f in region])


def _ahead(config, factors):
    """The design of as many factors as may go on, with the levels of those whose centre and half
    width the configuration names."""
    rules = config.response_surface
    named = [f for f in factors if _named(rules, f)]
    others = [f for f in factors if f not in named]
    varied = [*named, *others][: config.screening.at_most]
    region = [_around(f, rules.centre.get(f.name, f.centre), config) for f in varied]
    design = region_design(region, rules).drop(columns=[f.name for f in varied if f in others])
    return [Points("response_surface", design, config.experiment, config.own_run)]


def _named(rules, factor):
    return factor.name in rules.centre and factor.name in rules.half_width


def _around(factor, centre, config):
    """The factor with levels centre -+ half width: the configured one or a fifth of the factor's
    range.

    Levels beyond what is physically possible move the region, unless the configuration names them.
    Half the centre is the most, so that no friction becomes zero.
    """
    rules = config.response_surface
    half = rules.half_width.get(factor.name, 0.2 * (factor.high - factor.low))
    half = min(half, 0.5 * abs(centre))
    if not _named(rules, factor):
        limits = physical_range(factor.key, config.experiment)
        centre, half = inside(centre, half, *limits)
    return replace(factor, low=round(centre - half, 9), high=round(centre + half, 9))


def response_surface(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Quadratic model, ANOVA, diagnostics and plots. Runs without a response are left out and
    named. Runs beyond the outlier limit are named, and the fit without them stands beside the fit
    of all runs. Raises CalibrationError where a model cannot be fitted."""
    config = study.config
    region = read_region(source.region)
    every = with_responses(read_written(source.design), config)
    with naming_left_out(every):
        runs = with_value(every)
        surface = fit_surface(runs, [f.code for f in region], runs["response"])
    write_table(every, output.runs)
    write_table(surface.coefficients, output.coefficients)
    write_table(surface.anova, output.anova)
    write_table(surface.diagnostics.assign(run=runs["run"].to_numpy()), output.diagnostics)
    response = figures.response_of(config.target)
    figures.save(predicted_actual(surface, response), output.predicted)
    figures.save(residual_panel(surface, response), output.residuals)
    figures.save(perturbation(surface, region, response), output.perturbation)
    figures.save(surfaces(surface, region, response), output.surfaces)
    beside = _beside(runs, [f.code for f in region], "response", surface)
    write_json(output.summary, _description(surface, region) | beside | told(every))


def _beside(runs, codes, column, surface):
    """Return what stands beside the fit of all runs: outliers with the fit without them, and the
    model that hierarchy leaves."""
    found = outliers(surface)
    beside = {
        "outliers": [
            {
                "run": int(runs["run"].iloc[k]),
                "studentised": float(surface.diagnostics["externally_studentised"].iloc[k]),
            }
            for k in found
        ],
        "outlier_limit": None if surface.df < 2 else outlier_limit(surface),
        "decide_alone": _decide_alone(surface, runs),
        "reduced": _fit_words(reduced_surface(runs, codes, runs[column])),
    }
    if len(found):
        rest = runs.drop(index=runs.index[found]).reset_index(drop=True)
        try:
            beside["without_outliers"] = _fit_words(fit_surface(rest, codes, rest[column]))
        except CalibrationError as error:
            beside["without_outliers"] = {"not_fitted": str(error)}
    return beside


def _decide_alone(surface, runs):
    """Runs of leverage 1: their residual is none, and PRESS and the predicted R2, which divide by
    one less the leverage (Allen 1974, Technometrics 16:125), are not defined. A Box-Behnken design
    of three factors has one where a run of an edge is lost: the opposite run."""
    return runs.loc[surface.diagnostics["studentised"].isna(), "run"].astype(int).tolist()


def _fit_words(surface):
    found = surface.summary.items()
    statistics = {name: value if np.isfinite(value) else None for name, value in found}
    return {"equation_coded": surface.equation(), "statistics": statistics}


def _description(surface, region):
    """Return what a response surface is, for JSON: equation, statistics and stationary point."""
    stationary = surface.canonical()
    return _fit_words(surface) | {
        "stationary_point": {
            f.name: f.natural(float(x)) for f, x in zip(region, stationary["point"], strict=True)
        },
        "stationary_kind": stationary["kind"],
        "eigenvalues": [float(v) for v in stationary["eigenvalues"]],
    }


def predicted_actual(surface: Surface, response: Response) -> Drawing:
    """Predicted against simulated response."""
    figure, ax = figures.subplots(size=(4.2, 4.0))
    d = surface.diagnostics
    ax.scatter(d["actual"], d["predicted"], color=figures.BLUE)
    ends = [
        min(d["actual"].min(), d["predicted"].min()),
        max(d["actual"].max(), d["predicted"].max()),
    ]
    ax.plot(ends, ends, color=figures.GREY, lw=1)
    unit = response.brackets
    ax.set(
        xlabel=f"simulated {response.name}{unit}",
        ylabel=f"predicted by the quadratic model{unit}",
        aspect="equal",
    )
    return figure


def residual_panel(surface: Surface, response: Response) -> Drawing:
    """Normal plot of residuals, residuals against prediction and run, and Cook's distance."""
    d = surface.diagnostics
    figure, ax = figures.subplots(2, 2, size=(7.2, 5.8))
    z = np.sort(d["externally_studentised"])
    q = scipy.stats.norm.ppf((np.arange(1, len(z) + 1) - 0.5) / len(z))
    ax[0, 0].scatter(z, q, color=figures.BLUE)
    ax[0, 0].plot(q, q, color=figures.GREY, lw=1)
    ax[0, 0].set(xlabel="externally studentised residual", ylabel="normal quantile")
    for panel, x, name in (
        (ax[0, 1], d["predicted"], f"predicted{response.brackets}"),
        (ax[1, 0], d["run"], "run"),
    ):
        panel.scatter(x, d["externally_studentised"], color=figures.BLUE)
        limit = scipy.stats.t.ppf(1 - 0.025 / len(d), max(surface.df - 1, 1))
        for y in (-limit, 0, limit):
            panel.axhline(y, color=figures.GREY, lw=1, ls="-" if y == 0 else "--")
        panel.set(xlabel=name, ylabel="externally studentised residual")
    ax[1, 1].vlines(d["run"], 0, d["cooks_distance"], color=figures.BLUE)
    ax[1, 1].axhline(1.0, color=figures.GREY, lw=1, ls="--")
    ax[1, 1].set(xlabel="run", ylabel="Cook's distance")
    return figure


def perturbation(surface: Surface, region: Sequence[Factor], response: Response) -> Drawing:
    """Response along each factor with the others at the centre."""
    figure, ax = figures.subplots()
    x = np.linspace(-1, 1, 81)
    for k, factor in enumerate(region):
        levels = np.zeros((len(x), len(region)))
        levels[:, k] = x
        ax.plot(x, surface.predict(levels), label=f"{factor.code}  {figures.label(factor.name)}")
    ax.set(xlabel="distance from the centre, coded", ylabel=response.axis)
    figure.legend(loc="outside upper center", frameon=False)  # beside the lines, not over them
    return figure


def surfaces(surface: Surface, region: Sequence[Factor], response: Response) -> Drawing:
    """Response surfaces of all pairs of factors, the others at the centre."""

    def draw(ax, pair):
        a, b, levels = plane(region, *pair, resolution=31)
        y = surface.predict(levels).reshape(a.shape)
        # some thousand faces: as an image they weigh a tenth, and the words stay words
        ax.plot_surface(a, b, y, cmap="viridis", alpha=0.9, rasterized=True)
        label_3d(ax, *(figures.label(region[k].name) for k in pair), response.axis)

    return figures.panels(combinations(range(len(region)), 2), (3.9, 3.6), draw, projection="3d")


STAGES = (
    Stage(
        name="response_surface",
        title="Response surface",
        place=3,
        chain=True,
        searches=True,
        plans=(Plan("response_surface", ahead=_ahead),),
        figures=(
            Figure("surfaces", ("coefficients.csv",)),
            Figure("predicted_actual", ("diagnostics.csv",)),
            Figure("residuals", ("diagnostics.csv",)),
            Figure("perturbation", ("coefficients.csv",)),
        ),
        tables=(
            ("runs", "Design and results"),
            ("anova", "Analysis of variance"),
            ("coefficients", "Coefficients, in coded levels"),
            ("diagnostics", "Residuals and influence"),
        ),
        sentences=worded("response_surface"),
        pictured="response_surface",
    ),
)
