"""The stages of the chain: each reads its input files and writes its output files.

They hold no statistics of their own; those are in `design`, `regression`, `optimise` and `validate`.
"""

import json
import sys
import traceback
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path

import pandas as pd

from calibration import figures
from calibration.campaign import plan, read_metric, write_plan
from calibration.config import Config, read_target
from calibration.design import (
    box_behnken,
    path_from_effects,
    plackett_burman,
    read_two_level,
    steepest_path,
)
from calibration.errors import CalibrationError
from calibration.factors import Factor, read_factors
from calibration.optimise import solve
from calibration.regression import fit_surface, screen, significant
from calibration.validate import compare
from dem.errors import DemError
from dem.io.files import write_json


@contextmanager
def logged(log):
    """Send what a stage prints to its log; an error of ours ends the job with one line there and on the screen."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w") as stream, redirect_stdout(stream), redirect_stderr(stream):
        try:
            yield
        except (CalibrationError, DemError) as error:
            print(error, file=stream)
            print(error, file=sys.__stderr__)
            sys.exit(1)
        except Exception:
            traceback.print_exc(file=stream)
            raise


def settings_of(data, bench_file=None):
    """`Config` of already checked settings; the levels that the bench tests found, where given, replace its own."""
    config = Config.model_validate(data)
    if not bench_file:
        return config
    return config.model_copy(update={"fixed": config.fixed | _load(bench_file)["fixed"]})


def _load(path):
    return json.loads(Path(path).read_text())


def _with_response(design_file, config):
    """The design table with the runs' results in column `response`."""
    design = pd.read_csv(design_file)
    design["response"] = read_metric(design["run_id"], config.target.metric)
    spread = config.target.metric.replace("_deg", "_sd_deg")
    if spread != config.target.metric:
        design["response_sd"] = read_metric(design["run_id"], spread)
    return design


def _chosen(factors, names):
    return [next(f for f in factors if f.name == n) for n in names]


def plan_screening(config, folder):
    """Plan the Plackett-Burman design: the configured table of coded levels, or a generated one."""
    factors, rules = read_factors(config.factors), config.screening
    if rules.design:
        design = read_two_level(rules.design, factors, rules.replicates)
    else:
        design = plackett_burman(factors, rules.replicates, rules.runs)
    write_plan(folder, *plan(design, factors, config))


def analyse_screening(config, design_file, output):
    """Effects, ANOVA and charts; writes the names of the factors that go on, largest effect first."""
    factors = read_factors(config.factors)
    runs = _with_response(design_file, config)
    rules = config.screening
    result = screen(runs, [f.code for f in factors], runs["response"], rules.alpha)
    # a configured path says which factors the user wants to follow where the screening leaves the choice open
    preferred = (
        [f.code for f in factors if f.name in config.ascent.step]
        if config.ascent.rule == "configured"
        else []
    )
    codes = significant(result, rules.alpha, rules.at_least, rules.at_most, preferred)
    if rules.go_on:
        codes = [f.code for f in factors if f.name in rules.go_on]
    names = {f.code: f.name for f in factors}
    table = result.table.assign(name=result.table["code"].map(names))
    runs.to_csv(output.runs, index=False)
    table.to_csv(output.effects, index=False)
    result.anova.to_csv(output.anova, index=False)
    figures.save(figures.half_normal(table, codes), output.half_normal)
    limits = result.t_limit, result.bonferroni_limit, rules.alpha
    figures.save(figures.pareto(table, *limits), output.pareto)
    write_json(
        output.summary,
        {
            "factors": [names[c] for c in codes],
            "significant": [names[c] for c in significant(result, rules.alpha, at_least=0)],
            "effects": dict(zip(table["name"], table["effect"], strict=True)),
            "p": dict(zip(table["name"], table["p"], strict=True)),
            "method": result.method,
            "alpha": rules.alpha,
        },
    )


def plan_ascent(config, screening_file, folder):
    """Plan the path: as configured where all factors are covered, else along the effects."""
    screening, factors = _load(screening_file), read_factors(config.factors)
    chosen = _chosen(factors, screening["factors"])
    start, step = config.ascent.start, config.ascent.step
    configured = config.ascent.rule == "configured" and all(
        f.name in start and f.name in step for f in chosen
    )
    if not configured:
        effects = {f.code: screening["effects"][f.name] for f in chosen}
        start, step = path_from_effects(chosen, effects, config.ascent.steps)
    design = steepest_path(chosen, start, step, config.ascent.steps)
    design["path"] = "configured" if configured else "effects"
    write_plan(folder, *plan(design, factors, config))


def analyse_ascent(config, design_file, output):
    """The path's results and the point nearest to the target, which becomes the region's centre."""
    factors = read_factors(config.factors)
    runs = _with_response(design_file, config)
    target = float(read_target(config).mean())
    runs["relative_error"] = (runs["response"] - target).abs() / target
    best = runs.loc[runs["relative_error"].idxmin()]
    used = [f for f in factors if f.name in runs]
    runs.to_csv(output.runs, index=False)
    figures.save(figures.ascent_path(runs, used, target, int(best["run"])), output.path)
    write_json(
        output.summary,
        {
            "centre": {f.name: float(best[f.name]) for f in used},
            "step": int(best["run"]),
            "response": float(best["response"]),
            "target": target,
            "path": str(best["path"]),
            "responses": [float(v) for v in runs["response"]],
        },
    )


def plan_response_surface(config, ascent_file, folder):
    """Plan the Box-Behnken design around the ascent's centre, or the configured one, and record its region."""
    factors, ascent = read_factors(config.factors), _load(ascent_file)
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
    """The factor with levels centre -+ half width; the box is cut to what physics allows (no negative friction)."""
    half = config.response_surface.half_width.get(factor.name, 0.2 * factor.half_range * 2)
    low = centre - half
    if low <= 0.0:
        raise CalibrationError(
            f"the region of {factor.name} would reach {low:g}; choose a smaller half width"
        )
    return replace(factor, low=round(low, 9), high=round(centre + half, 9))


def read_region(path):
    """Factors with the levels of the response surface's region."""
    return [Factor(**f) for f in _load(path)]


def analyse_response_surface(config, design_file, region_file, output):
    """Quadratic model, ANOVA, diagnostics and plots."""
    region = read_region(region_file)
    runs = _with_response(design_file, config)
    surface = fit_surface(runs, [f.code for f in region], runs["response"])
    runs.to_csv(output.runs, index=False)
    surface.coefficients.to_csv(output.coefficients, index=False)
    surface.anova.to_csv(output.anova, index=False)
    surface.diagnostics.to_csv(output.diagnostics, index=False)
    figures.save(figures.predicted_actual(surface), output.predicted)
    figures.save(figures.residual_panel(surface), output.residuals)
    figures.save(figures.perturbation(surface, region), output.perturbation)
    figures.save(figures.surfaces(surface, region), output.surfaces)
    stationary = surface.canonical()
    write_json(
        output.summary,
        {
            "equation_coded": surface.equation(),
            "statistics": surface.summary,
            "stationary_point": {
                f.name: f.natural(float(x))
                for f, x in zip(region, stationary["point"], strict=True)
            },
            "stationary_kind": stationary["kind"],
            "eigenvalues": [float(v) for v in stationary["eigenvalues"]],
            "ridge": _ridge(surface, region),
        },
    )


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


def plan_candidate(config, optimum_file, folder):
    """Plan the runs at the candidate that the response surface alone gives."""
    factors, optimum = read_factors(config.factors), _load(optimum_file)["optimum"]
    rows = pd.DataFrame([{"run": k + 1} | optimum for k in range(config.optimise.candidate_runs)])
    write_plan(folder, *plan(rows, factors, config))


def augmented_runs(config, runs_file, region, candidate_file):
    """The response surface's runs with those at the candidate added, in the same columns."""
    candidate = _with_response(candidate_file, config)
    for f in region:
        candidate[f.code] = f.coded(candidate[f.name])
    return pd.concat([pd.read_csv(runs_file), candidate], ignore_index=True)


def optimise(config, runs_file, region_file, output, candidate_file=None):
    """Solve the surface for the measured mean; with `candidate_file` the runs at the candidate are fitted as well."""
    region = read_region(region_file)
    if candidate_file:
        runs = augmented_runs(config, runs_file, region, candidate_file)
    else:
        runs = pd.read_csv(runs_file)
    measured = read_target(config)
    surface = fit_surface(runs, [f.code for f in region], runs["response"])
    rules = config.optimise
    point = [f.coded(rules.point.get(f.name, f.centre)) for f in region]
    solution = solve(surface, float(measured.mean()), rules.rule, config.seed, point)
    count = config.validation.groups * config.validation.replicates
    low, high = surface.confirmation_interval([solution.chosen], count)
    # what differs beyond six digits is the solver's noise, which must not rename the cached validation runs
    optimum = [round(float(x), 6) for x in solution.chosen]
    points = pd.DataFrame(
        {f.name: f.natural(solution.points[:, k]) for k, f in enumerate(region)}
        | {f"{f.code}_coded": solution.points[:, k] for k, f in enumerate(region)}
    )
    points.to_csv(output.solutions, index=False)
    figures.save(figures.contours(surface, region, solution), output.contours)
    first, last = solution.extent()
    write_json(
        output.summary,
        {
            "target": solution.target,
            "attainable": solution.attainable,
            "rule": solution.rule,
            "optimum": {f.name: f.natural(x) for f, x in zip(region, optimum, strict=True)},
            "optimum_coded": {f.code: x for f, x in zip(region, optimum, strict=True)},
            "predicted": solution.predicted,
            "confirmation_interval": [float(low[0]), float(high[0])],
            "confirmation_runs": count,
            "fitted_runs": len(runs),
            "standard_error": float(surface.standard_error([solution.chosen])[0]),
            "solution_set": {
                f.name: [f.natural(float(a)), f.natural(float(b))]
                for f, a, b in zip(region, first, last, strict=True)
            },
        },
    )


def plan_validation(config, optimum_file, folder):
    """Plan groups of replicates at the optimum."""
    factors, optimum = read_factors(config.factors), _load(optimum_file)["optimum"]
    rows = [
        {"run": g * config.validation.replicates + r + 1, "group": g + 1, "replicate": r + 1}
        | optimum
        for g in range(config.validation.groups)
        for r in range(config.validation.replicates)
    ]
    write_plan(folder, *plan(pd.DataFrame(rows), factors, config))


def analyse_validation(config, design_file, output):
    """Compare the replicates with the measurement."""
    runs = _with_response(design_file, config)
    measured = read_target(config)
    groups = runs.pivot(index="group", columns="replicate", values="response").to_numpy()
    result = compare(groups, measured, config.validation.margin, config.validation.alpha)
    runs.to_csv(output.runs, index=False)
    figures.save(figures.validation(groups, measured, result), output.figure)
    write_json(
        output.summary, result.as_dict() | {"group_means": [float(v) for v in groups.mean(axis=1)]}
    )
