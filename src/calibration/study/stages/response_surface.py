"""Box-Behnken response surface: a quadratic model of the region."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.study.factors import read_factors
from calibration.study.stages.stage import Figure, Plan, Stage

if TYPE_CHECKING:
    from calibration.study.config import Config


def runs(config: Config) -> int:
    """Number of runs of the design, of as many factors as may go on."""
    from calibration.statistics.composite import surface_design

    rules, going_on = config.response_surface, read_factors(config.factors)
    region = going_on[: config.screening.at_most]
    design = surface_design(region, rules.centre_runs, rules.replicates)
    return len(design) + rules.added_runs


STAGES = (
    Stage(
        name="response_surface",
        title="Response surface",
        place=3,
        plans=(Plan("response_surface", expected=runs),),
        figures=(
            Figure("surfaces", ("coefficients.csv",)),
            Figure("predicted_actual", ("diagnostics.csv",)),
            Figure("residuals", ("diagnostics.csv",)),
            Figure("perturbation", ("coefficients.csv",)),
        ),
        tables=(
            ("runs", "Design and results"),
            ("anova", "Analysis of variance"),
            ("coefficients", "Coefficients, in coded levels"),
            ("diagnostics", "Residuals and influence"),
        ),
        sentences="calibration.chain.response_surface:sentences",
        pictured="response_surface",
    ),
)
