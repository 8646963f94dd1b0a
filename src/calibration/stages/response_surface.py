"""Response surface: a quadratic model of the region."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from calibration import figures
from calibration.campaign import plan, write_plan
from calibration.factors import read_factors
from calibration.files import write_table
from calibration.responses import with_responses
from calibration.stages.files import further_files, load, read_region
from calibration.statistics.design import box_behnken
from calibration.statistics.surface import fit_surface
from dem.io.files import write_json


def plan_response_surface(config, ascent_file, folder):
    """Plan the Box-Behnken design around the ascent's centre, or the configured one, and record its region."""
    factors, ascent = read_factors(config.factors), load(ascent_file)
    varied = [f for f in factors if f.name in ascent["centre"]]
    centre = ascent["centre"] | config.response_surface.centre
    region = [_around(f, centre[f.name], config) for f in varied]
    design = box_behnken(
        region, config.response_surface.centre_runs, config.response_surface.replicates
    )
    table, specs = plan(design, [*region, *(f for f in factors if f not in varied)], config)
    write_plan(folder, table, specs)
    write_json(Path(folder) / "region.json", [vars(f) for f in region])


def _around(factor, centre, config):
    """The factor with levels centre -+ half width: the configured one or a fifth of the factor's range, and at most
    half the centre, so that no friction becomes zero or less."""
    half = config.response_surface.half_width.get(factor.name, 0.2 * (factor.high - factor.low))
    half = min(half, 0.5 * abs(centre))
    return replace(factor, low=round(centre - half, 9), high=round(centre + half, 9))


def analyse_response_surface(config, design_file, region_file, output):
    """Quadratic model, ANOVA, diagnostics and plots."""
    region = read_region(region_file)
    runs = with_responses(pd.read_csv(design_file), config)
    surface = fit_surface(runs, [f.code for f in region], runs["response"])
    write_table(runs, output.runs)
    write_table(surface.coefficients, output.coefficients)
    write_table(surface.anova, output.anova)
    write_table(surface.diagnostics, output.diagnostics)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.predicted_actual(surface, quantity), output.predicted)
    figures.save(figures.residual_panel(surface, quantity), output.residuals)
    figures.save(figures.perturbation(surface, region, quantity), output.perturbation)
    figures.save(figures.surfaces(surface, region, quantity), output.surfaces)
    write_json(output.summary, _description(surface, region))
    for target, path, figure in further_files(config, output):
        other = fit_surface(runs, [f.code for f in region], runs[target.metric])
        write_json(path, _description(other, region))
        quantity = figures.quantity_of(target.metric)
        figures.save(figures.surfaces(other, region, quantity), figure)


def _description(surface, region):
    """What a response surface is, for JSON: equation, statistics, stationary point and ridge."""
    stationary = surface.canonical()
    return {
        "equation_coded": surface.equation(),
        "statistics": surface.summary,
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
