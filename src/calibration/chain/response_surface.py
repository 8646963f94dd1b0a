"""Response surface: a quadratic model of the region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration import figures
from calibration.chain.files import further_files, read_region
from calibration.chain.responses import naming_left_out, told, with_responses, with_value
from calibration.errors import CalibrationError
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import plan, write_plan
from calibration.statistics.composite import region_design
from calibration.statistics.numbers import fixed
from calibration.statistics.surface import (
    fit_surface,
    outlier_limit,
    outliers,
    reduced_surface,
)
from calibration.study.physical_limits import inside, physical_range
from dem.io.files import write_json

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.figures import Response


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
    write_plan(Path(output.plan).parent, table, specs)
    write_json(output.region, [vars(f) for f in region])


def _around(factor, centre, config):
    """The factor with levels centre -+ half width: the configured one or a fifth of the factor's
    range.

    Levels beyond what is physically possible move the region, and half the centre is the most, so
    that no friction becomes zero.
    """
    half = config.response_surface.half_width.get(factor.name, 0.2 * (factor.high - factor.low))
    half = min(half, 0.5 * abs(centre))
    limits = physical_range(factor.key, config.experiment)
    centre, half = inside(centre, half, *limits)
    return replace(factor, low=round(centre - half, 9), high=round(centre + half, 9))


def response_surface(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Quadratic model, ANOVA, diagnostics and plots. Runs without a response are left out and
    named. Runs beyond the outlier limit are named, and the fit without them stands beside the fit
    of all runs. Raises CalibrationError where a model cannot be fitted, naming the further target
    that it is of."""
    config = study.config
    region = read_region(source.region)
    every = with_responses(read_written(source.design), config)
    with naming_left_out(every):
        runs = with_value(every, "response")
        surface = fit_surface(runs, [f.code for f in region], runs["response"])
    write_table(every, output.runs)
    write_table(surface.coefficients, output.coefficients)
    write_table(surface.anova, output.anova)
    write_table(surface.diagnostics.assign(run=runs["run"].to_numpy()), output.diagnostics)
    response = figures.response_of(config.target.metric)
    figures.save(figures.predicted_actual(surface, response), output.predicted)
    figures.save(figures.residual_panel(surface, response), output.residuals)
    figures.save(figures.perturbation(surface, region, response), output.perturbation)
    figures.save(figures.surfaces(surface, region, response), output.surfaces)
    beside = _beside(runs, [f.code for f in region], "response", surface)
    write_json(output.summary, _description(surface, region) | beside | told(every))
    for target, path, figure in further_files(config, output):
        here = with_value(every, target.metric)
        try:
            other = fit_surface(here, [f.code for f in region], here[target.metric])
        except CalibrationError as error:
            raise CalibrationError(f"further target {target.metric}: {error}") from None
        write_json(path, _description(other, region))
        response = figures.response_of(target.metric)
        figures.save(figures.surfaces(other, region, response), figure)


def _beside(runs, codes, column, surface):
    """What stands beside the fit of all runs: outliers with the fit without them, and the model
    that hierarchy leaves."""
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
    """What a response surface is, for JSON: equation, statistics, stationary point and ridge."""
    stationary = surface.canonical()
    return _fit_words(surface) | {
        "stationary_point": {
            f.name: f.natural(float(x)) for f, x in zip(region, stationary["point"], strict=True)
        },
        "stationary_kind": stationary["kind"],
        "eigenvalues": [float(v) for v in stationary["eigenvalues"]],
        "ridge": _ridge(surface, region),
    }


def _ridge(surface, region):
    """Points of the largest and least response at growing coded distance from the centre."""
    radii = [0.25, 0.5, 0.75, 1.0]
    rows = []
    for way, rising in (("largest", True), ("least", False)):
        points = surface.ridge(radii, rising)
        for radius, point, response in zip(radii, points, surface.predict(points), strict=True):
            levels = {f.name: f.natural(float(x)) for f, x in zip(region, point, strict=True)}
            rows.append({"way": way, "radius": radius, "response": float(response)} | levels)
    return rows


def sentences(summary: Mapping[str, Any], response: Response) -> list[str]:
    """What came out, for the report."""
    s = summary["statistics"]
    lack = s["lack_of_fit_p"]
    return [
        f"{response.name.capitalize()} = {summary['equation_coded']} in coded levels.",
        f"R² {s['R2']:.3f}, adjusted {fixed(s['R2_adj'], 3)}, predicted {_or_none(s['R2_pred'])}; "
        f"CV {s['CV_percent']:.2f} %; adequate precision {s['adequate_precision']:.1f}; "
        f"lack of fit {'not tested' if lack is None else f'p = {lack:.2g}'}.",
        *_unpredicted(summary),
    ]


def _unpredicted(summary):
    """Why there is no predicted R2, and what it is without the terms that say nothing."""
    alone = summary.get("decide_alone")
    if not alone:
        return []
    less = summary["reduced"]["statistics"]["R2_pred"]
    runs = f"Run {alone[0]} alone decides" if len(alone) == 1 else (
        f"Runs {', '.join(map(str, alone[:-1]))} and {alone[-1]} each decide alone")  # fmt: skip
    return [
        f"{runs} a term of the model, as other runs of the design have no value, so nothing "
        "predicts it and there is no predicted R². Without the terms that say nothing it is "
        f"{_or_none(less)}."
    ]


def _or_none(value):
    return "none" if value is None else fixed(value, 3)
