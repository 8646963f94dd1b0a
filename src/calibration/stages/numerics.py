"""What choices beside the parameters cost: the same points with other resolutions, time steps,
moduli and rolling laws; and heaps at the optimum over the rate at which grains arrive.

The same heap is poured at each rate, and out of a funnel that is filled and then opened. Near the
rate that the orifice passes, the funnel can pack in some runs and not in others.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import scipy
from pydantic import BaseModel, Field, ValidationError

from calibration import figures
from calibration.chain.handed_over import NamedFiles
from calibration.chain.study import Study
from calibration.errors import CalibrationError, ConfigError, first_fault
from calibration.figures import Drawing, Response
from calibration.files import read_json, write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_plan, read_values, together, write_plan
from calibration.stages import worded
from calibration.statistics.validate import mean_interval
from calibration.study.config import overlay, point_spec
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.experiments.heap import capacity
from dem.grains.sizes import grain_volume
from dem.io.files import write_json
from dem.io.mapping import line_of, read_mapping
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


Seeds = Annotated[int, Field(ge=1, le=1000)]


class Variant(BaseModel, extra="forbid"):
    """Keys that are laid over the run spec, and the variant that it is compared with."""

    run: dict[str, Any]
    against: str = ""
    seeds: Seeds | None = None


class Numerics(BaseModel, extra="forbid"):
    """What `config/numerics.yaml` holds: points {name: {factor: level}}, and variants."""

    seeds: Seeds
    points: dict[str, dict[str, Annotated[float, Field(allow_inf_nan=False)] | str]] = Field(
        min_length=1
    )
    variants: dict[str, Variant] = Field(min_length=1)


def read_numerics(path: str | Path, factors: Sequence[str]) -> Numerics:
    """Points and variants of a file; `factors`: the names that a point may have. Raises
    ConfigError, and SpecError for a file that is no YAML."""
    data, lines = read_mapping(path)
    try:
        wanted = Numerics.model_validate(data)
    except ValidationError as error:
        found = first_fault(error)
        where = {"path": path, "line": line_of(found["key"] or "", lines)}
        raise ConfigError("is not valid", **where, **found) from None
    named = [(f"points.{p}.{n}", n, factors) for p, levels in wanted.points.items() for n in levels]
    against = {name: v.against for name, v in wanted.variants.items() if v.against}
    named += [
        (f"variants.{n}.against", other, list(wanted.variants)) for n, other in against.items()
    ]
    for key, name, allowed in named:
        if name not in allowed:
            where = {"path": path, "line": line_of(key, lines), "key": key, "value": name}
            raise ConfigError("is not known", **where, allowed=", ".join(allowed))
    return wanted


def plan_numerics(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan every variant at every point with every seed."""
    wanted = read_numerics(source.variants, [f.name for f in study.factors])
    parts = []
    for name, variant in wanted.variants.items():
        rows = [
            {"variant": name, "against": variant.against, "point": point, **levels}
            for point, levels in wanted.points.items()
            for _ in range(variant.seeds or wanted.seeds)
        ]
        run = overlay(study.config.own_run, variant.run)
        parts.append(study.plan(pd.DataFrame(rows), run=run))
    write_plan(output.plan, *together(parts))


def compare_variants(design: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Table: variant, against, point, n (runs with a value), without_value (runs without), mean,
    sd, difference, low, high (95 % Welch interval), within_seed_spread. What too few values tell is
    NaN."""
    design = design.assign(response=read_values(design["run_id"], metric))
    rows = []
    for (name, point), group in design.groupby(["variant", "point"], sort=False):
        ours, against = group["response"].dropna(), group["against"].iloc[0]
        row = {"variant": name, "against": against, "point": point, "n": len(ours)}
        row |= {"without_value": len(group) - len(ours)}
        row |= {"mean": ours.mean(), "sd": ours.std()}
        if isinstance(against, str) and against:
            other = (design["variant"] == against) & (design["point"] == point)
            row |= _difference(ours, design.loc[other, "response"].dropna())
        rows.append(row)
    return pd.DataFrame(rows)


def _difference(ours, theirs):
    """Of the means of two samples (series); NaN where one has fewer than two values."""
    if min(len(ours), len(theirs)) < 2:
        return dict.fromkeys(("difference", "low", "high", "seed_sd"), np.nan)
    low, high = scipy.stats.ttest_ind(ours, theirs, equal_var=False).confidence_interval(0.95)
    spread = float(np.sqrt((ours.var() + theirs.var()) / 2))
    difference = ours.mean() - theirs.mean()
    row = {"difference": difference, "low": low, "high": high, "seed_sd": spread}
    return row | {"within_seed_spread": bool(abs(difference) < spread)}


def numerics(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write the table of differences and its figure."""
    metric = study.config.target.metric
    table = compare_variants(read_written(source.design), metric).round(3)
    write_table(table, output.table)
    figures.save(numerics_figure(table, figures.response_of(metric)), output.figure)


def numerics_figure(table: pd.DataFrame, response: Response) -> Drawing:
    """Difference that each numerical choice makes at each point, with its interval; table as of
    `compare_variants`."""
    compared = table[table["difference"].notna()]
    names, points = list(dict.fromkeys(compared["variant"])), list(dict.fromkeys(table["point"]))
    figure, ax = figures.subplots(size=(5.6, 0.32 * len(names) + 1.2))
    for k, point in enumerate(points):
        rows = compared[compared["point"] == point]
        y = [names.index(v) + 0.18 * (k - (len(points) - 1) / 2) for v in rows["variant"]]
        low, high = rows["difference"] - rows["low"], rows["high"] - rows["difference"]
        ax.errorbar(rows["difference"], y, xerr=[low, high], fmt="o", ms=4, label=point)
    ax.axvline(0.0, color=figures.GREY, lw=1)
    ax.set_yticks(range(len(names)), names, fontsize=8)
    ax.invert_yaxis()
    ax.set_xlabel(f"difference of the {response.name}{response.brackets}, 95 % interval")
    ax.legend(frameon=False, fontsize=8, title="point", title_fontsize=8, loc="upper left")
    return figure


STAGES = (
    Stage(
        name="numerics",
        title="What the numerical choices cost",
        place=11,
        plans=(Plan("numerics"),),
        figures=(Figure("numerics"),),
        tables=(("numerics", "Numerics"),),
        about="Difference that resolution, time step, stiffness and rolling law make, with its 95 "
        "% interval: a choice whose interval holds zero, or that stays within the spread from "
        "seed to seed, does not matter here.",
    ),
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
