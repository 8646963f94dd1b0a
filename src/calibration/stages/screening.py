"""Screening: which factors matter."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain import responses
from calibration.chain.study import NamedFiles, Study
from calibration.figures import Drawing, Response
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import write_plan
from calibration.stages import worded
from calibration.statistics.design import alias_groups, screening_design
from calibration.statistics.screening import (
    aliases,
    interactions,
    screen,
    significant,
    why,
)
from calibration.study.factors import read_factors
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.io.files import write_json


def plan_screening(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the design: the configured table of coded levels, or a generated one."""
    points = _ahead(study.config, study.factors)
    write_plan(output.plan, *study.plan_points(points))


def _ahead(config, factors):
    """The design, which the configuration and the factors decide."""
    design = screening_design(factors, config.screening)
    return [Points("screening", design, config.experiment, config.own_run)]


def screening(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Effects, ANOVA and charts; writes the names of the factors that go on, largest effect first,
    and why each does.

    Runs without an angle are left out and named. With a foldover the configured table's own runs
    decide, and the effects of both halves together stand beside them; where too many of its own
    have no angle to tell the factors apart, both halves decide.
    """
    config = study.config
    factors = read_factors(config.factors)
    every = responses.with_responses(read_written(source.design), config)
    rules = config.screening
    runs = _deciding(config, factors, every)
    result = _screened(config, factors, runs)
    codes, reasons = _going_on(config, factors, result)
    names, table = {f.code: f.name for f in factors}, result.table
    write_table(every, output.runs)
    write_table(table, output.effects)
    write_table(result.anova, output.anova)
    response = figures.response_of(config.target)
    figures.save(half_normal(table, codes, response), output.half_normal)
    limits = result.t_limit, result.bonferroni_limit, rules.alpha
    figures.save(pareto(table, *limits, response), output.pareto)
    summary = {
        "factors": [names[c] for c in codes],
        "why": {names[c]: words for c, words in reasons.items()},
        "significant": [names[c] for c in significant(result, rules.alpha, at_least=0)],
        **_numbers(result),
        "aliased": _aliased(factors, responses.with_value(runs)),
        "method": result.method,
        **aliasing(runs, [f.code for f in factors]),
        "alpha": rules.alpha,
        **responses.told(every),
    }
    if rules.foldover and rules.design and runs is every:
        summary["halves"] = {"runs": len(responses.with_value(every))}
    elif rules.foldover:
        both = _screened(config, factors, every)
        summary["with_foldover"] = {
            **_numbers(both),
            "significant": [names[c] for c in significant(both, rules.alpha, at_least=0)],
            "method": both.method,
            "runs": len(responses.with_value(every)),
            "aliased": _aliased(factors, responses.with_value(every)),
            **aliasing(every, [f.code for f in factors]),
        }
    write_json(output.summary, summary)


def _deciding(config, factors, every):
    """The runs that decide: all, or those of a configured table without its foldover if they tell
    the factors apart."""
    rules, codes = config.screening, [f.code for f in factors]
    if not (rules.foldover and rules.design):
        return every
    own = every[every["fold"] == 1]
    levels = responses.with_value(own)[codes].to_numpy(float)
    apart = np.linalg.matrix_rank(np.column_stack([np.ones(len(levels)), levels])) > len(codes)
    return own if apart else every


def _aliased(factors, runs):
    """Interactions that the runs do not part from each other or from a factor, in the factors'
    codes: a list of texts like AB = CD."""
    codes = [f.code for f in factors]
    groups = alias_groups(runs[codes].to_numpy(float), codes)
    return [" = ".join("".join(member) for member in group) for group in groups if len(group) > 1]


def aliasing(runs: pd.DataFrame, codes: list[str]) -> dict[str, Any]:
    """Return what the runs of a screening do not tell apart, for JSON.

    aliases: {code: {pair: share}} of the interactions that each main effect carries; vif: the
    largest variance inflation; lack_of_fit: what the main effects leave beyond the scatter of
    repeated runs, and the interactions that take most of it, None without repeats.
    """
    here = responses.with_value(runs)
    result = screen(here, codes, here["response"])
    anova = result.anova.set_index("source")
    found = {
        "aliases": aliases(here[codes], codes),
        "vif": float(result.table["vif"].max()),
        "lack_of_fit": None,
    }
    table = interactions(here, codes, here["response"])
    if table is None:
        return found
    first = table[np.isclose(table["sum_sq"], table["sum_sq"][0])]
    lack = anova.loc["Lack of Fit"]
    return found | {
        "lack_of_fit": {
            "F": float(lack["F"]),
            "p": float(lack["p"]),
            "sd": float(np.sqrt(lack["mean_sq"])),
            "pure_error_sd": result.seed_sd,
            "largest": sorted(first["pair"]),
            "share": float(first["share"].iloc[0]),
        }
    }


def _screened(config, factors, runs):
    """The `Screening` of the runs that have a response, with the factors' names."""
    names = {f.code: f.name for f in factors}
    with responses.naming_left_out(runs):
        here = responses.with_value(runs)
        own = screen(here, list(names), here["response"], config.screening.alpha)
    return replace(own, table=own.table.assign(name=own.table["code"].map(names)))


def _going_on(config, factors, deciding):
    """Codes of the factors that go on, and why each does."""
    rules = config.screening
    # a configured path says which factors the user wants to follow where the screening leaves the
    # choice open
    preferred = (
        [f.code for f in factors if f.name in config.ascent.step]
        if config.ascent.rule == "configured"
        else []
    )
    if rules.go_on:
        codes = [f.code for f in factors if f.name in rules.go_on]
    else:
        codes = significant(deciding, rules.alpha, rules.at_least, rules.at_most, preferred)
    return codes, why(deciding, codes, rules.alpha, preferred, rules.go_on)


def _numbers(result):
    """Effects and their p for JSON: against the residual or Lenth's error, and against the scatter
    of seeds alone."""
    table = result.table.set_index("name")
    found = {"effects": table["effect"].to_dict(), "p": table["p"].to_dict()}
    if result.seed_sd is not None:
        found |= {"p_seeds": table["p_seeds"].to_dict(), "seed_sd": result.seed_sd}
    return found


def half_normal(table: pd.DataFrame, chosen: Sequence[str], response: Response) -> Drawing:
    """Half-normal plot of absolute effects; `chosen` codes stand out."""
    figure, ax = figures.subplots()
    size, score = table["effect"].abs(), table["half_normal_score"]
    picked = table["code"].isin(chosen)
    ax.scatter(size[~picked], score[~picked], color=figures.GREY, label="stays at its level")
    ax.scatter(size[picked], score[picked], color=figures.ORANGE, label="goes on")
    for e, s, code, name in zip(size, score, table["code"], table["name"], strict=True):
        text = f"{code}  {figures.label(name)}" if code in chosen else code
        ax.annotate(text, (e, s), xytext=(6, -3), textcoords="offset points", fontsize=9)
    small = ~picked if (~picked).any() else picked
    slope = float((score[small] * size[small]).sum() / (size[small] ** 2).sum())
    line = np.array([0.0, float(score.max()) / slope])
    ax.plot(line, slope * line, color=figures.GREY, lw=1)
    ax.set(
        xlabel=f"|effect|{response.brackets}",
        ylabel="half-normal quantile",
        xlim=(0, 1.45 * size.max()),
        ylim=(0, 1.15 * score.max()),
    )
    ax.legend(loc="lower right", frameon=False)
    return figure


def pareto(
    table: pd.DataFrame, t_limit: float, bonferroni_limit: float, alpha: float, response: Response
) -> Drawing:
    """Pareto chart of absolute effects with the limits of significance at level alpha."""
    from matplotlib.patches import Patch

    figure, ax = figures.subplots()
    order = table.reindex(table["effect"].abs().sort_values().index)
    colour = np.where(order["effect"] > 0, figures.BLUE, figures.ORANGE)
    names = [f"{figures.label(n)}  {c}" for n, c in zip(order["name"], order["code"], strict=True)]
    ax.barh(names, order["effect"].abs(), color=colour)
    limits = (t_limit, "--", "t limit"), (bonferroni_limit, ":", "Bonferroni")
    lines = [
        ax.axvline(x, color="black", lw=1, ls=style, label=f"{words} {100 * alpha:g} %")
        for x, style, words in limits
    ]
    ax.set(xlabel=f"|effect|{response.brackets}")
    # below the whole figure: a line under the axis would be centred on it and cut off beside it
    ways = {figures.BLUE: f"raises the {response.name}", figures.ORANGE: "lowers it"}
    figure.legend(
        handles=[*(Patch(color=colour, label=words) for colour, words in ways.items()), *lines],
        loc="outside lower center", ncols=2, frameon=False, fontsize=9,
    )  # fmt: skip
    return figure


STAGES = (
    Stage(
        name="screening",
        title="Screening",
        place=1,
        chain=True,
        searches=True,
        plans=(Plan("screening", ahead=_ahead),),
        figures=(Figure("half_normal", ("effects.csv",)), Figure("pareto", ("effects.csv",))),
        tables=(
            ("runs", "Design and results"),
            ("effects", "Effects"),
            ("anova", "Analysis of variance"),
        ),
        sentences=worded("screening"),
        pictured="screening",
    ),
)
