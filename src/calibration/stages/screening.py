"""Screening: which factors matter."""

import pandas as pd

from calibration import figures
from calibration.campaign import plan, write_plan
from calibration.factors import read_factors
from calibration.files import write_table
from calibration.responses import columns, strongest, with_responses
from calibration.stages.files import further_files
from calibration.statistics.design import screening_design
from calibration.statistics.screening import screen, significant
from dem.io.files import write_json


def plan_screening(config, folder):
    """Plan the Plackett-Burman design: the configured table of coded levels, or a generated one."""
    factors, rules = read_factors(config.factors), config.screening
    design = screening_design(factors, rules.replicates, rules.runs, rules.design)
    write_plan(folder, *plan(design, factors, config), inputs=[config.factors, rules.design])


def analyse_screening(config, design_file, output):
    """Effects, ANOVA and charts; writes the names of the factors that go on, largest effect first."""
    factors = read_factors(config.factors)
    runs = with_responses(pd.read_csv(design_file), config)
    rules = config.screening
    screened = {
        column: screen(runs, [f.code for f in factors], runs[column], rules.alpha)
        for column in columns(config)
    }
    result = screened["response"]
    deciding = strongest(list(screened.values())) if config.further_targets else result
    # a configured path says which factors the user wants to follow where the screening leaves the choice open
    preferred = (
        [f.code for f in factors if f.name in config.ascent.step]
        if config.ascent.rule == "configured"
        else []
    )
    codes = significant(deciding, rules.alpha, rules.at_least, rules.at_most, preferred)
    if rules.go_on:
        codes = [f.code for f in factors if f.name in rules.go_on]
    names = {f.code: f.name for f in factors}
    table = result.table.assign(name=result.table["code"].map(names))
    write_table(runs, output.runs)
    write_table(table, output.effects)
    write_table(result.anova, output.anova)
    for target, path, figure in further_files(config, output):
        other = screened[target.metric]
        effects = other.table.assign(name=other.table["code"].map(names))
        write_table(effects, path)
        limits = other.t_limit, other.bonferroni_limit, rules.alpha
        quantity = figures.quantity_of(target.metric)
        figures.save(figures.pareto(effects, *limits, quantity), figure)
    quantity = figures.quantity_of(config.target.metric)
    figures.save(figures.half_normal(table, codes, quantity), output.half_normal)
    limits = result.t_limit, result.bonferroni_limit, rules.alpha
    figures.save(figures.pareto(table, *limits, quantity), output.pareto)
    write_json(
        output.summary,
        {
            "factors": [names[c] for c in codes],
            "significant": [names[c] for c in significant(deciding, rules.alpha, at_least=0)],
            "effects": dict(zip(table["name"], table["effect"], strict=True)),
            "p": dict(zip(table["name"], table["p"], strict=True)),
            "method": result.method,
            "alpha": rules.alpha,
        },
    )
