"""Validation: replicates at the parameters handed out, against the measurement."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain.responses import naming_left_out, told, with_responses, with_value
from calibration.chain.study import NamedFiles, Study
from calibration.figures import Drawing, Response
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import write_plan
from calibration.stages import worded
from calibration.statistics.equivalence import Stated, compare
from calibration.study.config import read_target
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json


def handed_out(source: NamedFiles) -> dict[str, float]:
    """{factor: level} of the parameters that a study hands out: the optimum of the chain, or the
    middle one of the draws that meet all tests, which is the first."""
    if draws := source.get("draws"):
        return {str(name): float(x) for name, x in read_written(draws).iloc[0].items()}
    found: dict[str, float] = read_json(source.optimum)["optimum"]
    return found


def plan_validation(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan groups of replicates at the parameters that are handed out. Their seeds are their own:
    a run that led to the choice does not judge it."""
    points = _replicates(study.config, handed_out(source))
    write_plan(output.plan, *study.plan_points(points))


def _replicates(config, levels):
    """`Points` of the replicates at {factor: level}."""
    rules = config.validation
    rows = [
        {"run": g * rules.replicates + r + 1, "group": g + 1, "replicate": r + 1} | levels
        for g in range(rules.groups)
        for r in range(rules.replicates)
    ]
    return [Points("validation", pd.DataFrame(rows), config.experiment, config.own_run)]


def validation(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Compare the replicates with the measurement."""
    config = study.config
    runs = with_responses(read_written(source.design), config)
    rules = config.validation
    write_table(runs, output.runs)
    groups, measured = _groups(runs), read_target(config)
    result = compare(groups, measured, rules.margin, rules.alpha)
    shown = figures.response_of(config.target)
    figures.save(validation_figure(groups, measured, result, shown), output.figure)
    found = result | told(runs)
    found["group_means"] = [float(v) for v in groups.mean(axis=1)]
    write_json(output.summary, found)


def _groups(runs):
    """Values (groups, replicates); where runs have none, the others as one group."""
    with naming_left_out(runs):
        with_value(runs)  # raises where there is too little to compare
    groups = runs.pivot(index="group", columns="replicate", values="response").to_numpy(float)
    missing = np.isnan(groups)
    return groups[~missing][None] if missing.any() else groups


def validation_figure(
    groups: np.ndarray,
    measured: np.ndarray | Stated,
    result: Mapping[str, Any],
    response: Response,
) -> Drawing:
    """Replicates by group beside the measurement, with means and the equivalence margin. measured:
    readings (n,), or a `Stated` mean, which is drawn with its standard deviation."""
    figure, ax = figures.subplots()
    for g, values in enumerate(groups):
        ax.scatter(np.full(len(values), g + 1), values, color=figures.BLUE, alpha=0.7)
        ax.hlines(values.mean(), g + 0.75, g + 1.25, color=figures.BLUE, lw=2)
    place = len(groups) + 1.5
    if isinstance(measured, Stated):
        ax.errorbar([place], [measured.mean()], [measured.std()], color=figures.ORANGE, alpha=0.7)
    else:
        jitter = np.linspace(-0.2, 0.2, len(measured))
        ax.scatter(place + jitter, measured, color=figures.ORANGE, alpha=0.7)
    ax.hlines(measured.mean(), place - 0.35, place + 0.35, color=figures.ORANGE, lw=2)
    ax.axhspan(
        measured.mean() - result["margin"],
        measured.mean() + result["margin"],
        color=figures.ORANGE,
        alpha=0.12,
        lw=0,
    )
    ax.axhline(result["simulated_mean"], color=figures.BLUE, lw=1, ls="--")
    ax.set_xticks(
        [*range(1, len(groups) + 1), place],
        [*(f"group {g + 1}" for g in range(len(groups))), "measured"],
    )
    simulated, aim = (response.value(result[f"{of}_mean"]) for of in ("simulated", "measured"))
    means = f"simulated {simulated}, measured {aim}"
    ax.set(ylabel=response.axis, title=f"{means}: {result['relative_error_percent']:.2f} % apart")
    return figure


STAGES = (
    Stage(
        name="validation",
        title="Validation",
        place=5,
        chain=True,
        plans=(Plan("validation", lambda config, _: _replicates(config, {})),),
        figures=(Figure("validation", ("runs.csv", "validation.json")),),
        tables=(("runs", "Replicates"),),
        sentences=worded("validation"),
        pictured="validation",
    ),
)
