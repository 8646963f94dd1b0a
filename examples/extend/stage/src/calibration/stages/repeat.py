"""The middle of all factors with several seeds: how far runs of one point lie apart."""

import pandas as pd

from calibration import figures
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, write_plan
from calibration.study.stage import Figure, Plan, Stage
from dem.io.files import write_json

RUNS = 5


def plan_repeat(study, source, output):
    """Plan the runs."""
    middle = {factor.name: 0.5 * (factor.low + factor.high) for factor in study.factors}
    design, specs = study.plan(pd.DataFrame([middle] * RUNS))
    write_plan(output.plan, design, specs)


def repeat(study, source, output):
    """Their mean and standard deviation, in the unit of the target."""
    metric = study.config.target
    table = read_written(source.design)
    table["response"] = read_values(table["run_id"], metric)
    write_table(table, output.table)
    found = {"mean": float(table["response"].mean()), "sd": float(table["response"].std())}
    write_json(output.summary, found)
    figure = spread_of_seeds(table["response"], figures.response_of(metric))
    figures.save(figure, output.figure)


def spread_of_seeds(values, response):
    """A point for each run and a line at their mean; values (n,) in the unit of the response."""
    figure, ax = figures.subplots()
    ax.scatter(range(1, len(values) + 1), values, color=figures.BLUE)
    ax.axhline(values.mean(), color=figures.BLUE, lw=1)
    ax.set(xlabel="run", ylabel=response.axis)
    return figure


def sentences(summary, response):
    """What came out, for the page."""
    return [f"Runs of one point scatter by {response.value(summary['sd'])}."]


STAGES = (
    Stage(
        name="repeat",
        title="How far runs of one point lie apart",
        place=7.6,
        plans=(Plan("repeat"),),
        figures=(Figure("spread_of_seeds", ("runs.csv",)),),
        tables=(("runs", "The runs"),),
        sentences=sentences,
    ),
)
