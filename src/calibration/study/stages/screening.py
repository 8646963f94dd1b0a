"""Screening: which factors matter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.study.factors import read_factors
from calibration.study.stages.stage import Figure, Plan, Stage

if TYPE_CHECKING:
    from calibration.study.config import Config


def runs(config: Config) -> int:
    """Number of runs of the design."""
    # takes half a second to load, which a run need not wait for once the stage is planned
    from calibration.statistics.screening_design import screening_design

    return len(screening_design(read_factors(config.factors), config.screening))


STAGES = (
    Stage(
        name="screening",
        title="Screening",
        place=1,
        plans=(Plan("screening", expected=runs),),
        figures=(Figure("half_normal", ("effects.csv",)), Figure("pareto", ("effects.csv",))),
        tables=(
            ("runs", "Design and results"),
            ("effects", "Effects"),
            ("anova", "Analysis of variance"),
        ),
        sentences="calibration.chain.screening:sentences",
        pictured="screening",
    ),
)
