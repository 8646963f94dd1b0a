"""The stages of the diagnosis, as `calibration.study.stage` describes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.study.stage import Figure, Plan, Stage

if TYPE_CHECKING:
    from calibration.chain.study import Study


WAVES = 2
"""Times that the emulators of a diagnosis are refined: each is a plan and a training."""


def batches(study: Study) -> int:
    """Jobs that the emulators' runs of a diagnosis are divided into."""
    from diagnosis.measurements import need_emulators
    from diagnosis.settings import study_settings  # loads the catalogue

    asked = need_emulators(study.config.measurements)
    return study_settings(study.config).batches if asked else 1


def _rules(config):
    """Rules of a diagnosis before the one that ends it, without its waves; one that trains nothing
    plans nothing."""
    from diagnosis.measurements import need_emulators

    plans = ("diagnosis_plan",) if need_emulators(config.measurements) else ()
    return (*plans, "diagnosis_identify")


PLANS = (
    "diagnosis",
    *(f"diagnosis/wave_{k}" for k in range(1, WAVES + 1)),
    "diagnosis/extension",
)

STAGES = (
    Stage(
        name="diagnosis",
        title="What the calibrated model gets wrong",
        place=6,
        plans=tuple(Plan(folder, batches=batches, kept=True) for folder in PLANS),
        figures=tuple(map(Figure, ("gain", "ranking", "residuals"))),
        tables=(("residuals", "Residuals"),),
        made_by="diagnose",
        also_made_by=_rules,
    ),
    Stage(name="diagnosis_power", title="What a plan of measurements would show", place=6.05),
)
