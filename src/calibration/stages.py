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
from calibration.campaign import plan, write_plan
from calibration.config import Config, goals, read_target
from calibration.design import (
    box_behnken,
    path_from_effects,
    plackett_burman,
    read_two_level,
    steepest_path,
)
from calibration.errors import CalibrationError
from calibration.export.parameters import parameter_interval
from calibration.factors import Factor, read_factors
from calibration.figures_desirability import desirability_contours
from calibration.optimise import compromise, solve
from calibration.regression import fit_surface, screen, significant
from calibration.targets import columns, judge, nearest, strongest, with_responses
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


def settings_of(data, bench_files=()):
    """`Config` of already checked settings; the levels that the bench tests found, where given, replace its own."""
    config = Config.model_validate(data)
    for file in bench_files or ():
        config = config.model_copy(update={"fixed": config.fixed | _load(file)["fixed"]})
    return config


def _load(path):
    return json.loads(Path(path).read_text())


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
    runs = with_responses(pd.read_csv(design_file), config)
    rules = config.screening
    screened = {
        column: screen(runs, [f.code for f in factors], runs[column], rules.alpha)
        for column in columns(config)
    }
    result = screened["response"]
    deciding = strongest(list(screened.values())) if config.further_targets else result
    # a configured path says which factors the user wants to follow where the screening leaves the choice open
    preferred = (
        [f.code for f in factors if f.name in config.ascent.step]
        if config.ascent.rule == "configured"
        else []
    )
    codes = significant(deciding, rules.alpha, rules.at_least, rules.at_most, preferred)
    if rules.go_on:
        codes = [f.code for f in factors if f.name in rules.go_on]
    names = {f.code: f.name for f in factors}
    table = result.table.assign(name=result.table["code"].map(names))
    runs.to_csv(output.runs, index=False)
    table.to_csv(output.effects, index=False)
    result.anova.to_csv(output.anova, index=False)
    for target, path, figure in _further(config, output):
        other = screened[target.metric]
        effects = other.table.assign(name=other.table["code"].map(names))
        effects.to_csv(path, index=False)
        limits = other.t_limit, other.bonferroni_limit, rules.alpha
        quantity = figures.quantity_of(target.metric)
        figures.save(figures.pareto(effects, *limits, quantity), figure)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.half_normal(table, codes, quantity), output.half_normal)
    limits = result.t_limit, result.bonferroni_limit, rules.alpha
    figures.save(figures.pareto(table, *limits, quantity), output.pareto)
    write_json(
        output.summary,
        {
            "factors": [names[c] for c in codes],
            "significant": [names[c] for c in significant(deciding, rules.alpha, at_least=0)],
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
    """The path's results and the point nearest to what is wanted, which becomes the region's centre."""
    factors = read_factors(config.factors)
    runs = judge(with_responses(pd.read_csv(design_file), config), config)
    target = float(read_target(config).mean())
    best = nearest(runs)
    used = [f for f in factors if f.name in runs]
    runs.to_csv(output.runs, index=False)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.ascent_path(runs, used, target, int(best["run"]), quantity), output.path)
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
    """The factor with levels centre -+ half width: the configured one or a fifth of the factor's range, and at most
    half the centre, so that no friction becomes zero or less."""
    half = config.response_surface.half_width.get(factor.name, 0.2 * (factor.high - factor.low))
    half = min(half, 0.5 * abs(centre))
    return replace(factor, low=round(centre - half, 9), high=round(centre + half, 9))


def read_region(path):
    """Factors with the levels of the response surface's region."""
    return [Factor(**f) for f in _load(path)]


def analyse_response_surface(config, design_file, region_file, output):
    """Quadratic model, ANOVA, diagnostics and plots."""
    region = read_region(region_file)
    runs = with_responses(pd.read_csv(design_file), config)
    surface = fit_surface(runs, [f.code for f in region], runs["response"])
    runs.to_csv(output.runs, index=False)
    surface.coefficients.to_csv(output.coefficients, index=False)
    surface.anova.to_csv(output.anova, index=False)
    surface.diagnostics.to_csv(output.diagnostics, index=False)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.predicted_actual(surface, quantity), output.predicted)
    figures.save(figures.residual_panel(surface, quantity), output.residuals)
    figures.save(figures.perturbation(surface, region, quantity), output.perturbation)
    figures.save(figures.surfaces(surface, region, quantity), output.surfaces)
    write_json(output.summary, _description(surface, region))
    for target, path, figure in _further(config, output):
        other = fit_surface(runs, [f.code for f in region], runs[target.metric])
        write_json(path, _description(other, region))
        quantity = figures.quantity_of(target.metric)
        figures.save(figures.surfaces(other, region, quantity), figure)


def _further(config, output):
    """(target, file, figure) of each further target; nothing with one target."""
    if not config.further_targets:
        return ()
    return zip(config.further_targets, output.further, output.further_figures, strict=True)


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


def plan_candidate(config, optimum_file, folder):
    """Plan the runs at the candidate that the response surface alone gives."""
    factors, optimum = read_factors(config.factors), _load(optimum_file)["optimum"]
    rows = pd.DataFrame([{"run": k + 1} | optimum for k in range(config.optimise.candidate_runs)])
    write_plan(folder, *plan(rows, factors, config))


def augmented_runs(config, runs_file, region, candidate_file):
    """The response surface's runs with those at the candidate added, in the same columns."""
    candidate = with_responses(pd.read_csv(candidate_file), config)
    for f in region:
        candidate[f.code] = f.coded(candidate[f.name])
    return pd.concat([pd.read_csv(runs_file), candidate], ignore_index=True)


def optimise(config, runs_file, region_file, output, candidate_file=None):
    """Solve the surface for the measured mean, or with several targets find the most desirable point; with
    `candidate_file` the runs at the candidate are fitted as well."""
    region = read_region(region_file)
    if candidate_file:
        runs = augmented_runs(config, runs_file, region, candidate_file)
    else:
        runs = pd.read_csv(runs_file)
    surfaces = [fit_surface(runs, [f.code for f in region], runs[c]) for c in columns(config)]
    if config.further_targets:
        found = _optimise_several(config, surfaces, region, output)
    else:
        found = _optimise_one(config, surfaces[0], region, output)
    write_json(output.summary, found | {"fitted_runs": len(runs)})


def _optimise_one(config, surface, region, output):
    """The point of the solution set that the configured rule takes."""
    rules = config.optimise
    point = [f.coded(rules.point.get(f.name, f.centre)) for f in region]
    wanted = float(read_target(config).mean())
    solution = solve(surface, wanted, rules.rule, config.seed, point)
    _write_points(solution.points, region, output.solutions)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.contours(surface, region, solution, quantity), output.contours)
    intervals = [
        parameter_interval(surface, wanted, solution.chosen, k) for k in range(len(region))
    ]
    return {
        "target": solution.target,
        "attainable": solution.attainable,
        "rule": solution.rule,
        "interval_95": {
            f.name: [f.natural(x) for x in interval]
            for f, interval in zip(region, intervals, strict=True)
        },
    } | _optimum(config, surface, region, solution.chosen, solution.extent())


def _optimise_several(config, surfaces, region, output):
    """The most desirable point; its solution set is the region that is nearly as desirable."""
    wanted = goals(config)
    found = compromise(surfaces, wanted, config.seed)
    _write_points(found.points, region, output.solutions)
    figures.save(desirability_contours(surfaces, wanted, region, found), output.contours)
    rows = zip(columns(config).values(), surfaces, wanted, strict=True)
    return (
        {
            "target": wanted[0].target,
            "attainable": bool(found.desirability > 1.0 - 1e-3),
            "rule": "desirability",
            "desirability": found.desirability,
        }
        | _optimum(config, surfaces[0], region, found.chosen, (found.low, found.high))
        | {
            "responses": {
                metric: _expected(config, surface, goal, found.chosen)
                for metric, surface, goal in rows
            }
        }
    )


def _expected(config, surface, goal, chosen):
    """What one of several responses is expected to be at the optimum."""
    predicted = float(surface.predict([chosen])[0])
    low, high = surface.confirmation_interval([chosen], _confirmation_runs(config))
    return {
        "goal": goal.kind,
        "target": goal.target,
        "predicted": predicted,
        "confirmation_interval": [float(low[0]), float(high[0])],
        "desirability": float(goal.desirability(predicted)),
    }


def _confirmation_runs(config):
    return config.validation.groups * config.validation.replicates


def _optimum(config, surface, region, chosen, extent):
    """The chosen point with the response that is expected there, and the extent (low, high) of its alternatives."""
    count = _confirmation_runs(config)
    low, high = surface.confirmation_interval([chosen], count)
    # what differs beyond six digits is the solver's noise, which must not rename the cached validation runs
    optimum = [round(float(x), 6) for x in chosen]
    return {
        "optimum": {f.name: f.natural(x) for f, x in zip(region, optimum, strict=True)},
        "optimum_coded": {f.code: x for f, x in zip(region, optimum, strict=True)},
        "predicted": float(surface.predict([chosen])[0]),
        "confirmation_interval": [float(low[0]), float(high[0])],
        "confirmation_runs": count,
        "standard_error": float(surface.standard_error([chosen])[0]),
        "solution_set": {
            f.name: [f.natural(float(a)), f.natural(float(b))]
            for f, a, b in zip(region, *extent, strict=True)
        },
    }


def _write_points(points, region, path):
    """Table of coded points (m, factors) in natural and coded levels."""
    pd.DataFrame(
        {f.name: f.natural(points[:, k]) for k, f in enumerate(region)}
        | {f"{f.code}_coded": points[:, k] for k, f in enumerate(region)}
    ).to_csv(path, index=False)


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
    """Compare the replicates with the measurement, and with the further ones where there are any."""
    runs = with_responses(pd.read_csv(design_file), config)
    rules = config.validation
    runs.to_csv(output.runs, index=False)
    groups = _groups(runs, "response")
    found = _compare(groups, config, config.target, rules.margin, output.figure)
    found["group_means"] = [float(v) for v in groups.mean(axis=1)]
    measured = [t for t in config.further_targets if t.file]
    drawn = dict(zip([t.metric for t in measured], output.get("further_figures", []), strict=True))
    if config.further_targets:
        found["further"] = {
            t.metric: _compare(_groups(runs, t.metric), config, t, t.margin, drawn[t.metric])
            if t.file
            else _summary(_groups(runs, t.metric))
            for t in config.further_targets
        }
    write_json(output.summary, found)


def _groups(runs, column):
    return runs.pivot(index="group", columns="replicate", values=column).to_numpy()


def _compare(groups, config, target, margin, figure):
    """Comparison of groups (g, r) with the measurement of a target, for JSON; draws it."""
    measured = read_target(config, target)
    result = compare(groups, measured, margin, config.validation.alpha)
    quantity = figures.quantity_of(target.metric)
    figures.save(figures.validation(groups, measured, result, quantity), figure)
    return result.as_dict()


def _summary(groups):
    """Mean and standard deviation of a response that has no measurement."""
    return {
        "simulated_mean": float(groups.mean()),
        "simulated_sd": float(groups.std(ddof=1)) if groups.size > 1 else None,
        "simulated_n": int(groups.size),
    }
