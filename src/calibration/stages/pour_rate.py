"""Angle over the pour rate: how much the rate at which grains arrive is worth, at the optimum.

The same heap is poured at each rate, and out of a funnel that is filled and then opened. Near the
rate that the orifice passes, the funnel can pack in some runs and not in others.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import scipy

from calibration import figures
from calibration.chain.handed_over import NamedFiles
from calibration.chain.study import Study
from calibration.errors import CalibrationError
from calibration.figures import Drawing, Response
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_plan, read_values, write_plan
from calibration.stages import worded
from calibration.statistics.validate import mean_interval
from calibration.study.config import overlay, point_spec
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.experiments.heap import capacity
from dem.grains.sizes import grain_volume
from dem.io.files import write_json
from dem.spec import parse_spec

OPENED = "opened"
LEVEL = 0.95


def plan_pour_rate(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan heaps at the optimum at each rate, and out of the opened funnel where that is asked."""
    points = _rigs(study.config, read_json(source.optimum)["optimum"])
    write_plan(output.plan, *study.plan_points(points))


def _rigs(config, levels):
    """`Points` of the heaps of each rig at {factor: level}."""
    rules = config.pour_rate
    rigs = [
        ("pour_rate.rates_per_s", f"{rate:g}", {"generation_rate_per_s": rate})
        for rate in rules.rates_per_s
    ]
    if rules.opened is not None:
        rigs.append(("pour_rate.opened", OPENED, {"feed": "opened"} | rules.opened))
    return [
        Points(
            key,
            pd.DataFrame([{"rig": rig} | levels] * rules.heaps),
            config.experiment,
            overlay(config.own_run, {"geometry": geometry}),
        )
        for key, rig, geometry in rigs
    ]


def pour_rate(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Mean, interval and hold-up of each rig, and what the capacity of the orifice is. Raises
    CalibrationError where no rig has two heaps with a value."""
    config = study.config
    design = read_written(source.design)
    for column, metric in (("response", config.target.metric), ("hold_up", "hold_up")):
        design[column] = read_values(design["run_id"], metric)
    rows = [_row(rig, heaps) for rig, heaps in design.groupby(design["rig"].astype(str))]
    table = pd.DataFrame([row for row in rows if row])
    if table.empty:
        raise CalibrationError("no rate has two heaps with a value")
    table = table.sort_values("rate_per_s", na_position="last", ignore_index=True)
    # the material may be the factors' or what `fixed` says, which a planned run has
    spec = parse_spec(next(iter(read_plan(Path(source.design).parent / "plan.json").values())))
    grain = spec.materials.particle.density_kg_m3 * grain_volume(spec)
    table["rate_g_s"] = 1e3 * grain * table["rate_per_s"]
    write_table(design, output.runs)
    write_table(table, output.table)
    run = parse_spec(point_spec(config.own_run, config.experiment, {}, 1))
    passes, fed = capacity(spec), run.geometry.generation_rate_per_s
    rigs = [{k: None if v != v else v for k, v in r.items()} for r in table.to_dict("records")]
    found = {"capacity_per_s": passes, "fed_per_s": fed, "grain_g": 1e3 * grain}
    write_json(output.summary, found | {"rigs": rigs})
    response = figures.response_of(config.target.metric)
    figures.save(pour_rate_figure(design, table, passes, fed, response), output.figure)


def _row(rig, heaps):
    """A row of the table, or None of a rig with fewer than two heaps."""
    values = heaps["response"].dropna()
    if len(values) < 2:
        return None
    mean, reach = mean_interval(values, len(values))
    return {
        "rig": rig,
        "rate_per_s": np.nan if rig == OPENED else float(rig),
        "heaps": len(values),
        "without": len(heaps) - len(values),
        "mean": mean,
        "low": mean - reach,
        "high": mean + reach,
        "sd": float(values.std(ddof=1)),
        "hold_up": float(heaps["hold_up"].mean()),
    }


def pour_rate_figure(
    runs: pd.DataFrame, table: pd.DataFrame, capacity: float, fed: float, response: Response
) -> Drawing:
    """Single heaps and the mean of each rate with its interval; the rate that the orifice passes,
    and the opened funnel as a band.

    runs: columns rig, response; table: rig, rate_per_s (NaN of the opened funnel), mean, low, high;
    capacity, fed: grains per second.
    """
    figure, ax = figures.subplots(size=(6.4, 3.8))
    rained = table[table["rate_per_s"].notna()]
    single = runs[runs["rig"].astype(str) != "opened"]
    ax.scatter(single["rig"].astype(float), single["response"], s=14, color=figures.BLUE, alpha=0.4)
    reach = np.array([rained["mean"] - rained["low"], rained["high"] - rained["mean"]])
    ax.errorbar(
        rained["rate_per_s"], rained["mean"], reach, color=figures.BLUE, marker="o", capsize=3,
        label="rain through the open funnel, mean and 95 %",
    )  # fmt: skip
    for row in table[table["rate_per_s"].isna()].to_dict("records"):
        ax.axhspan(row["low"], row["high"], color=figures.ORANGE, alpha=0.2, lw=0)
        ax.axhline(row["mean"], color=figures.ORANGE, lw=1.5, label="filled funnel that is opened")
    ax.axvline(capacity, color="black", ls="--", lw=1, label="the orifice passes (Beverloo)")
    ax.axvline(fed, color=figures.GREY, ls=":", lw=1.5, label="this study")
    ax.set(xlabel="grains made per second", ylabel=response.axis)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    return figure


def _reach_of_any(a, b, rates):
    """Half of the interval of a difference that was picked among all pairs of so many means: Games
    and Howell (1976), Journal of Educational Statistics 1:113."""
    parts = np.array([row["sd"] ** 2 / row["heaps"] for row in (a, b)])
    freedom = parts.sum() ** 2 / (parts**2 / [a["heaps"] - 1, b["heaps"] - 1]).sum()
    quantile = scipy.stats.studentized_range.ppf(LEVEL, rates, freedom)
    return float(quantile * np.sqrt(0.5 * parts.sum()))


STAGES = (
    Stage(
        name="pour_rate",
        title="How fast the grains arrive",
        place=7.5,
        plans=(Plan("pour_rate", lambda config, _: _rigs(config, {}) if config.pour_rate else []),),
        figures=(Figure("pour_rate", ("rates.csv", "runs.csv")),),
        tables=(("rates", "Rates and rigs"),),
        sentences=worded("pour_rate", reach_of_any=_reach_of_any),
    ),
)
