"""Validation: replicates at the optimum against the measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.study.stages.stage import Figure, Plan, Stage

if TYPE_CHECKING:
    from calibration.study.config import Config


def runs(config: Config) -> int:
    """Number of replicates."""
    return config.validation.groups * config.validation.replicates


STAGES = (
    Stage(
        name="validation",
        title="Validation",
        place=5,
        plans=(Plan("validation", expected=runs),),
        figures=(Figure("validation", ("runs.csv", "validation.json")),),
        tables=(("runs", "Replicates"),),
        sentences="calibration.chain.validation:sentences",
        pictured="validation",
    ),
)
