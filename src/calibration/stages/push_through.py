"""Draws pushed through: what the posterior leaves open in another experiment or rig.

Each machine that the configuration names is simulated with draws of the posterior, each draw some
times. The scatter of its metrics from draw to draw is what the freedom of the parameters costs
there.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike

from calibration import figures
from calibration.chain.study import NamedFiles, Study
from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.intake.measurements import read_measured
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, together, write_plan
from calibration.stages import worded
from calibration.statistics.ties import first_largest
from calibration.study.config.measured import pooled, rows_of
from calibration.study.config.schema import TestConfig
from calibration.study.config.tests import predicted
from calibration.study.simulated_tests import simulated
from calibration.study.stage import Figure, Plan, Stage
from dem.experiments import experiments
from dem.io.files import write_json

ALPHA = 0.05
"""Chance, over all parameters, at which one is said to decide a metric that none decides."""

LEAST_DRAWS = 4
"""Draws that an interval of a correlation needs (Fisher's z has n - 3)."""


def nested(values: ArrayLike, of: ArrayLike) -> dict[str, float | None]:
    """Of values (n,) at the draws `of` (n,), by the analysis of variance of one random effect: the
    mean of all, the interval that holds a further run at a further draw, and the standard
    deviations from draw to draw and from run to run at a draw (None where no draw has two).

    The interval is the 95 % t interval of a further value, its degrees of freedom by Satterthwaite
    (1946, Biometrics Bulletin 2:110). Draws of unequal number count by their harmonic mean. With
    one run at each draw the two scatters are not told apart: `sd_parameters` then holds both.
    Raises CalibrationError for fewer than three draws.
    """
    values, of = np.asarray(values, float), np.asarray(of)
    _, which = np.unique(of, return_inverse=True)
    runs = np.bincount(which)
    n = len(runs)
    if n < 3:
        raise CalibrationError(f"{n} draws have a value; at least 3 are needed for an interval")
    means = np.bincount(which, values) / runs
    r = float(n / np.sum(1.0 / runs))
    draws = means.var(ddof=1)  # variance of a draw, and of the mean of its runs
    freedom = int(runs.sum() - n)
    within = float(((values - means[which]) ** 2).sum() / freedom) if freedom else 0.0
    rest = within * (1.0 - 1.0 / r)
    total = draws + rest
    df = n - 1.0
    if freedom and total > 0.0:
        df = total**2 / (draws**2 / (n - 1) + rest**2 / freedom)
    reach = scipy.stats.t.ppf(0.975, df) * np.sqrt(total + draws / n)
    mean = float(means.mean())
    return {
        "mean": mean,
        "low": mean - float(reach),
        "high": mean + float(reach),
        "sd_parameters": float(np.sqrt(max(draws - within / r, 0.0))),
        "sd_seed": float(np.sqrt(within)) if freedom else None,
    }


def plan_push_through(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the machines: `draws` rows of the posterior, evenly through its table, each `replicates`
    times; every run has a seed of its own."""
    config, parts = study.config, []
    every = read_written(source.draws)
    names, rules = [f.name for f in study.factors if f.name in every], config.predict
    rows = np.linspace(0, len(every) - 1, min(rules.draws, len(every))).astype(int)
    for name in predicted(config):
        for k, levels in enumerate(every.loc[rows, names].to_dict("records")):
            point = {"machine": name, "draw": k + 1} | levels
            design = pd.DataFrame([point] * rules.replicates)
            seed = config.seed + k * rules.replicates
            parts.append(study.plan_test(design, simulated(config, name), seed))
    write_plan(output.plan, *together(parts))


def push_through(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The distribution of each metric of each machine, and the parameter that decides it. Writes
    the outputs that the rule declares."""
    config = study.config
    design = read_written(source.design)
    machines = {name: config.tests[name] for name in predicted(config)}
    runs = [_with_metrics(design, name, m) for name, m in machines.items()]
    write_table(pd.concat(runs, ignore_index=True), output.runs)
    measured, rows, drawn = read_measured(config.measurements), [], []
    for (name, machine), table in zip(machines.items(), runs, strict=True):
        parameters = _parameters(table)
        for metric in metrics_of(machine):
            has = table[table[metric].notna()]
            means = has.groupby("draw")[[metric, *parameters]].mean()
            row = {"machine": name, "experiment": machine.experiment, "metric": metric}
            row |= {"runs": len(has), "without": len(table) - len(has)}
            row |= _summary(config, row, has, means, measured)
            rows.append(row)
            if row["low"] is not None:
                drawn.append((row, table))
    write_table(pd.DataFrame(rows), output.metrics)
    write_json(output.summary, {"metrics": rows})
    figures.save(pushed_through(drawn), output.figure)


# the rules of the joint posterior's draws do the same
plan_joint_push_through, joint_push_through = plan_push_through, push_through


def metrics_of(machine: TestConfig) -> Sequence[str]:
    """The metrics that are reported of a machine."""
    return machine.metrics or experiments()[machine.experiment].targets


def _with_metrics(design, name, machine):
    table = design[design["machine"] == name].dropna(axis=1, how="all").reset_index(drop=True)
    for metric in metrics_of(machine):
        table[metric] = read_values(table["run_id"], metric)
    return table


def _parameters(table):
    """Columns of the levels that differ from draw to draw."""
    known = list(table.columns[: list(table.columns).index("seed")])
    return [c for c in known if c not in ("machine", "draw") and table[c].nunique() > 1]


def _summary(config, row, runs, means, table):
    """Of one metric of one machine: mean, its two scatters, the interval of a further run, the
    parameter that decides, and what was measured. runs: with a value; means: of each draw, the
    metric and its parameters; table: of measurements."""
    metric = row["metric"]
    try:
        found = nested(runs[metric], runs["draw"])
    except CalibrationError:
        empty = ("mean", "low", "high", "sd_parameters", "sd_seed", "decides", "rank_correlation")
        return dict.fromkeys((*empty, "measured", "within"))
    limits = next(m for m in experiments()[row["experiment"]].metrics if m.name == metric)
    found["low"], found["high"] = max(found["low"], limits.least), min(found["high"], limits.most)
    measured = _measured(config, table, row["machine"], metric)
    within = None if measured is None else bool(found["low"] <= measured <= found["high"])
    return found | _decides(means, metric) | {"measured": measured, "within": within}


def _decides(means, metric):
    """The parameter with the largest rank correlation over the draws, and that correlation; None
    where chance gives one as large with more than `ALPHA` (Bonferroni)."""
    parameters = list(means.columns.drop(metric))
    nothing = {"decides": None, "rank_correlation": None}
    if means[metric].nunique() < 2 or not parameters:
        return nothing
    found = {p: scipy.stats.spearmanr(means[p], means[metric]) for p in parameters}
    best = parameters[first_largest([abs(found[p].statistic) for p in parameters])]
    if len(means) < LEAST_DRAWS or found[best].pvalue * len(parameters) > ALPHA:
        return nothing
    return {"decides": best, "rank_correlation": float(found[best].statistic)}


def _measured(config, table, name, metric):
    """Mean of what was measured of the metric at the machine's settings; None where nothing was."""
    try:
        return pooled(rows_of(config, table, name, metric)).value
    except ConfigError:
        return None  # not measured, or at other settings


def pushed_through(rows: Sequence[tuple[Mapping[str, Any], pd.DataFrame]]) -> figures.Drawing:
    """Each metric of each machine over the parameter that decides it, with the interval of a
    further run and what was measured.

    rows: (row of the stage's table, table of the machine's runs), one a panel.
    """
    if not rows:
        figure, ax = figures.subplots(size=(4.0, 1.0))
        ax.set_axis_off()
        ax.text(0.5, 0.5, "no run gave a value", ha="center")
        return figure
    return figures.panels(rows, (4.1, 3.2), _panel)


def _panel(ax, pushed):
    row, table = pushed
    over = row["decides"] or "draw"
    ax.scatter(table[over], table[row["metric"]], s=14, color=figures.BLUE, alpha=0.7)
    ax.axhspan(row["low"], row["high"], color=figures.BLUE, alpha=0.1, lw=0)
    if row["measured"] is not None:
        ax.axhline(row["measured"], color=figures.ORANGE, lw=1.8, label="measured")
        ax.legend(frameon=False, fontsize=8)
    ax.set(xlabel=figures.label(over), ylabel=figures.response_of(row["metric"]).axis)
    ax.set_title(figures.label(row["machine"]), fontsize=9)


SHOWN: Any = {
    "figures": (Figure("push_through", ("metrics.csv", "runs.csv")),),
    "tables": (("metrics", "Each metric over the draws"),),
    "sentences": worded("push_through"),
}
"""What either shows."""


STAGES = (
    Stage(
        name="push_through",
        title="What stays open, in other machines",
        place=5.2,
        plans=(Plan("push_through"),),
        **SHOWN,
    ),
    Stage(
        name="joint_push_through",
        title="What all tests leave open, in other machines",
        place=5.4,
        plans=(Plan("joint_push_through"),),
        **SHOWN,
    ),
)
