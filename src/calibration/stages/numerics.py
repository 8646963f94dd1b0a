"""What the numerical choices cost: the same points with other resolutions, time steps, moduli and
rolling laws."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import scipy
from pydantic import BaseModel, Field, ValidationError

from calibration import figures
from calibration.chain.study import NamedFiles, Study
from calibration.errors import ConfigError, first_fault
from calibration.figures import Drawing, Response
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, together, write_plan
from calibration.study.config import overlay
from calibration.study.stage import Figure, Plan, Stage
from dem.io.mapping import line_of, read_mapping

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
        line = line_of(found["key"] or "", lines)
        raise ConfigError("is not valid", path=path, line=line, **found) from None
    named = [(f"points.{p}.{n}", n, factors) for p, levels in wanted.points.items() for n in levels]
    against = {name: v.against for name, v in wanted.variants.items() if v.against}
    named += [
        (f"variants.{n}.against", other, list(wanted.variants)) for n, other in against.items()
    ]
    for key, name, allowed in named:
        if name not in allowed:
            where = {"line": line_of(key, lines), "allowed": ", ".join(allowed)}  # type: dict
            raise ConfigError("is not known", path=path, key=key, value=name, **where)
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
    metric = study.config.target
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
)
