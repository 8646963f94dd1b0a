"""Optimum: the candidate of the response surface alone, and the optimum with the runs there
added."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain.responses import with_responses, with_value
from calibration.chain.study import NamedFiles, Study, read_region
from calibration.figures import Drawing, Response, plane
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import write_plan
from calibration.stages import worded
from calibration.statistics.design import region_design
from calibration.statistics.equivalence import mean_interval, runs_needed
from calibration.statistics.optimise import Solution, solve
from calibration.statistics.surface import Surface, fit_surface, outliers, parameter_interval
from calibration.study.config import Config, read_target
from calibration.study.factors import Factor, inside, physical_range
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json

OUTLIER_REPEATS = 2


def plan_candidate_first(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the first runs at the candidate that the response surface alone gives, and repeats of
    the surface's outliers.

    Where the target lies outside the region, the region moves: the runs are then the design of the
    region that the optimum's summary names.
    """
    config = study.config
    rows = _rows(config, read_json(source.optimum), config.optimise.candidate_runs)
    write_plan(output.plan, *study.plan(rows))


def plan_candidate(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The design of all runs at the candidate, the region that they are fitted in, and the plan of
    those that the first ones, finished by now, ask for. A region that moved asks for none."""
    config, found = study.config, read_json(source.optimum)
    first = read_written(source.first)
    moved, count = found.get("moved_region"), config.optimise.candidate_runs
    if not moved and config.optimise.candidate_half_width:
        count = _count(config.optimise, with_responses(first, config)["response"].head(count))
    write_json(output.region, {"moved": bool(moved), "region": moved or found["region"]})
    write_plan(output.plan, *study.plan(_rows(config, found, count)), first["run_id"])


def _ahead(config, factors):
    """The first runs at the candidate, wherever it will be."""
    rows = _rows(config, {"optimum": {}}, config.optimise.candidate_runs)
    return [Points("optimise", rows, config.experiment, config.own_run)]


def _rows(config, found, count):
    """Table of the points to run: the candidate `count` times and the outliers, or the region that
    moved. It may have no row."""
    if "moved_region" in found:
        region = [Factor(**f) for f in found["moved_region"]]
        rows = region_design(region, config.response_surface)
        return rows.drop(columns=[f.code for f in region])
    points = [found["optimum"]] * count
    points += [point for point in found.get("repeat", ()) for _ in range(OUTLIER_REPEATS)]
    rows = [{"run": k + 1} | point for k, point in enumerate(points)]
    return pd.DataFrame(rows, columns=["run", *found["optimum"]])


def _count(rules, responses):
    """Number of runs at the candidate in all, by the responses of the first ones; those without a
    value are made up for."""
    values = responses.dropna()
    if len(values) < 2:
        return len(responses)  # nothing is known of the scatter
    needed = runs_needed(values, rules.candidate_half_width, rules.candidate_at_most)
    return min(needed + len(responses) - len(values), rules.candidate_at_most)


def augmented_runs(
    config: Config, runs_file: str | Path, region: Sequence[Factor], candidate_file: str | Path
) -> pd.DataFrame:
    """The response surface's runs and those at the candidate, in the same columns and in the levels
    of `region`. Of a region that moved, only the runs that lie in it."""
    runs, candidate = read_written(runs_file), read_written(candidate_file)
    if len(candidate):
        runs = pd.concat([runs, with_responses(candidate, config)], ignore_index=True)
    for f in region:
        runs[f.code] = f.coded(runs[f.name])
    inside = (runs[[f.code for f in region]].abs() <= 1.0 + 1e-6).all(axis=1)
    return runs[inside].reset_index(drop=True)


def _optimise(config, runs_file, region_file, output, candidate_file=None):
    """Solve the surface for the measured mean. With `candidate_file` the runs at the candidate are
    fitted as well."""
    region = read_region(region_file)
    codes = [f.code for f in region]
    if candidate_file:
        runs = augmented_runs(config, runs_file, region, candidate_file)
    else:
        runs = read_written(runs_file)
    used = with_value(runs)
    surface = fit_surface(used, codes, used["response"])
    found = _solved(config, surface, region, output)
    if not found["attainable"] and not candidate_file:
        found["moved_region"] = _moved(config, region, found["optimum"])
    suspects = used.iloc[outliers(surface)]
    found["repeat"] = suspects[[f.name for f in region]].to_dict("records")
    found["region"] = [vars(f) for f in region]
    if candidate_file and not read_json(region_file)["moved"]:
        found |= _replicated(config, candidate_file, [f.name for f in region])
    write_json(output.summary, found | {"fitted_runs": len(used)})


def _replicated(config, candidate_file, names):
    """Return what the runs at the candidate say of their mean; nothing where it has no interval."""
    if config.optimise.candidate_runs < 2:
        return {}
    design = with_responses(read_written(candidate_file), config)
    here = design[(design[names] == design[names].iloc[0]).all(axis=1)]["response"]
    values, first = here.dropna(), here.head(config.optimise.candidate_runs).count()
    if first < 2:
        return {}
    mean, half = mean_interval(values, first)
    found = {"runs": len(values), "first_runs": int(first), "mean": mean, "half_width_95": half}
    return {"candidate": found | {"half_width_asked": config.optimise.candidate_half_width}}


def _moved(config, region, optimum):
    """The region of the same size about the point nearest to the target, within what is physically
    possible."""
    found = []
    for f in region:
        limits = physical_range(f.key, config.experiment)
        centre, half = inside(optimum[f.name], f.half_range, *limits)
        found.append(vars(replace(f, low=round(centre - half, 9), high=round(centre + half, 9))))
    return found


def _solved(config, surface, region, output):
    """The point of the solution set that is closest to the region's centre."""
    measured = read_target(config)
    wanted, error = float(measured.mean()), float(measured.std(ddof=1) / np.sqrt(len(measured)))
    solution = solve(surface, wanted, config.seed)
    points = solution.points.T
    natural = {f.name: f.natural(levels) for f, levels in zip(region, points, strict=True)}
    coded = {f"{f.code}_coded": levels for f, levels in zip(region, points, strict=True)}
    write_table(pd.DataFrame(natural | coded), output.solutions)
    response = figures.response_of(config.target)
    figures.save(contours(surface, region, solution, response), output.contours)
    intervals = [
        parameter_interval(surface, wanted, solution.chosen, k, 0.05, error, len(measured) - 1)
        for k in range(len(region))
    ]
    return {
        "target": solution.target,
        "target_se": error,
        "target_df": len(measured) - 1,
        "attainable": solution.attainable,
        "rule": "closest_to_centre",
        "interval_95_others_held": {
            f.name: [f.natural(x) for x in interval]
            for f, interval in zip(region, intervals, strict=True)
        },
    } | _optimum(config, surface, region, solution.chosen, (solution.low, solution.high))


def _optimum(config, surface, region, chosen, extent):
    """The chosen point with the response that is expected there, and the extent (low, high) of its
    alternatives."""
    count = config.validation.groups * config.validation.replicates
    low, high = surface.confirmation_interval([chosen], count)
    # what differs beyond six digits is the solver's noise, which must not rename the cached
    # validation runs
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


# as the workflow calls them


def candidate(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The optimum of the response surface alone."""
    _optimise(study.config, source.runs, source.region, output)


def optimise(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The optimum of the surface that is fitted to the runs at the candidate as well."""
    _optimise(study.config, source.runs, source.candidate_region, output, source.candidate)


def contours(
    surface: Surface, region: Sequence[Factor], solution: Solution, response: Response
) -> Drawing:
    """Contours through the chosen point with the solution set drawn in."""

    def draw(ax, pair):
        a, b, levels = plane(region, *pair, at=solution.chosen)
        y = surface.predict(levels).reshape(a.shape)
        filled = ax.contourf(a, b, y, 12, cmap="viridis", alpha=0.85)
        ax.figure.colorbar(filled, ax=ax, label=response.axis, shrink=0.9)
        if y.min() < solution.target < y.max():
            ax.contour(a, b, y, [solution.target], colors="white", linewidths=4.5)
            ax.contour(a, b, y, [solution.target], colors=figures.ORANGE, linewidths=2.5)
        _mark(ax, region, pair, solution.chosen)

    return figures.panels(combinations(range(len(region)), 2), (4.1, 3.5), draw)


def _mark(ax, region, pair, chosen):
    """Mark the chosen point over a pair of factors, which the axes are named after."""
    at = [region[k].natural(float(chosen[k])) for k in pair]
    ax.plot(*at, "o", color="white", mec="black", ms=9, clip_on=False, zorder=4)
    x, y = (figures.label(region[k].name) for k in pair)
    ax.set(xlabel=x, ylabel=y)
    ax.grid(False)


STAGES = (
    Stage(
        name="optimise",
        title="Optimum",
        place=4,
        chain=True,
        searches=True,
        plans=(Plan("candidate_first", ahead=_ahead), Plan("candidate")),
        figures=(Figure("contours", ("solution_set.csv", "optimum.json")),),
        tables=(("solution_set", "Points of the solution set"),),
        sentences=worded("optimise"),
        pictured="candidate",
        also_made_by=lambda config: ("candidate", "plan_candidate_first", "plan_candidate"),
    ),
)
