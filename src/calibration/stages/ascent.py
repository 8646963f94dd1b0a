"""Steepest ascent: the region to look at closely."""

from collections.abc import Sequence

import pandas as pd

from calibration import figures
from calibration.chain import responses
from calibration.chain.study import NamedFiles, Study
from calibration.figures import Drawing, Response
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import write_plan
from calibration.stages import worded
from calibration.statistics.design import path_from_effects, steepest_path
from calibration.statistics.factor import Factor
from calibration.study.config import read_target
from calibration.study.factors import read_factors
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json


def plan_ascent(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the path. It is the configured one if that covers all factors, else it follows the
    effects on the first target. All targets decide which of its points comes nearest."""
    screening = read_json(source.screening)
    chosen = [next(f for f in study.factors if f.name == name) for name in screening["factors"]]
    effects = {f.code: screening["effects"][f.name] for f in chosen}
    write_plan(output.plan, *study.plan(_path(study.config, chosen, effects)))


def _path(config, chosen, effects):
    """Design table of the path in the factors `chosen`."""
    rules = config.ascent
    start, step = rules.start, rules.step
    configured = rules.rule == "configured" and all(_named(config, f) for f in chosen)
    if not configured:
        start, step = path_from_effects(chosen, effects, rules.steps)
    design = steepest_path(chosen, start, step, rules.steps, rules.replicates)
    design["path"] = "configured" if configured else "effects"
    return design


def _named(config, factor):
    return factor.name in config.ascent.start and factor.name in config.ascent.step


def _ahead(config, factors):
    """The configured path in all factors that it names; without one its number of points."""
    named = [f for f in factors if _named(config, f)]
    if named and config.ascent.rule == "configured":
        design = _path(config, named, {})
    else:
        design = pd.DataFrame(index=range(config.ascent.steps * config.ascent.replicates))
    return [Points("ascent", design, config.experiment, config.own_run)]


def ascent(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The path's results and the point nearest to what is wanted, which becomes the region's
    centre."""
    config = study.config
    factors = read_factors(config.factors)
    every = responses.with_responses(read_written(source.design), config)
    with responses.naming_left_out(every):
        runs = responses.with_value(every)
    target = float(read_target(config).mean())
    points = _points(runs, len(every) // every["replicate"].max())
    best = points.loc[(points["response"] - target).abs().idxmin()]
    used = [f for f in factors if f.name in runs]
    error = (runs["response"] - target).abs() / abs(target)
    write_table(runs.assign(relative_error=error), output.runs)
    response = figures.response_of(config.target)
    figures.save(ascent_path(points, used, target, int(best["run"]), response), output.path)
    write_json(
        output.summary,
        {
            "centre": {f.name: float(best[f.name]) for f in used},
            "step": int(best["run"]),
            "response": float(best["response"]),
            "target": target,
            "path": str(best["path"]),
            "responses": [float(v) for v in points["response"]],
            "centre_named": sorted(config.response_surface.centre),
            **responses.told(every),
        },
    )


def _points(runs, steps):
    """The `steps` points of the path, `run` their number, each with the means of its runs."""
    number = (runs["run"] - 1) % steps + 1
    means = runs.assign(run=number).groupby("run", as_index=False).mean(numeric_only=True)
    return means.assign(path=runs["path"].iloc[0])


def ascent_path(
    runs: pd.DataFrame, factors: Sequence[Factor], target: float, best: int, response: Response
) -> Drawing:
    """Mean response at each point of the path with the target."""
    figure, ax = figures.subplots()
    ax.errorbar(
        runs["run"],
        runs["response"],
        yerr=runs.get("response_sd"),
        color=figures.BLUE,
        marker="o",
        capsize=3,
    )
    ax.axhline(target, color=figures.ORANGE, lw=1.2, label=f"measured {response.value(target)}")
    row = runs[runs["run"] == best].iloc[0]
    ax.scatter(
        [best],
        [row["response"]],
        s=140,
        facecolor="none",
        edgecolor=figures.ORANGE,
        zorder=3,
        label="centre of the region",
    )
    names = ["\n".join(f"{r[f.name]:.3g}" for f in factors) for _, r in runs.iterrows()]
    ax.set_xticks(runs["run"], names)
    ax.set(
        ylabel=response.axis,
        xlabel="\n".join(f"{i + 1}. line: {figures.label(f.name)}" for i, f in enumerate(factors)),
    )
    ax.legend(frameon=False)
    return figure


STAGES = (
    Stage(
        name="ascent",
        title="Steepest ascent",
        place=2,
        chain=True,
        searches=True,
        plans=(Plan("ascent", ahead=_ahead),),
        figures=(Figure("path", ("runs.csv",)),),
        tables=(("runs", "Path and results"),),
        sentences=worded("ascent"),
        pictured="ascent",
    ),
)
