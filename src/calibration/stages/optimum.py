"""Optimum: the candidate of the response surface alone, and the optimum with the runs there added."""

import pandas as pd

from calibration import figures
from calibration.campaign import plan, write_plan
from calibration.config import goals, read_target
from calibration.factors import read_factors
from calibration.files import write_table
from calibration.responses import columns, with_responses
from calibration.stages.files import load, read_region
from calibration.statistics.optimise import compromise, solve
from calibration.statistics.surface import fit_surface, parameter_interval
from dem.io.files import write_json


def plan_candidate(config, optimum_file, folder):
    """Plan the runs at the candidate that the response surface alone gives."""
    factors, optimum = read_factors(config.factors), load(optimum_file)["optimum"]
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
    } | _optimum(config, surface, region, solution.chosen, (solution.low, solution.high))


def _optimise_several(config, surfaces, region, output):
    """The most desirable point; its solution set is the region that is nearly as desirable."""
    wanted = goals(config)
    found = compromise(surfaces, wanted, config.seed)
    _write_points(found.points, region, output.solutions)
    figures.save(figures.desirability_contours(surfaces, wanted, region, found), output.contours)
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
    natural = {f.name: f.natural(points[:, k]) for k, f in enumerate(region)}
    coded = {f"{f.code}_coded": points[:, k] for k, f in enumerate(region)}
    write_table(pd.DataFrame(natural | coded), path)
