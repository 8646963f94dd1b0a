"""Validation: replicates at the optimum against the measurement."""

from calibration.study.stages.stage import (
    PLANNED,
    TARGETS,
    Figure,
    PerTarget,
    Runs,
    Stage,
    Task,
    bench_values,
)

STAGES = (
    Stage(
        name="validation",
        title="Validation",
        place=5,
        tasks=(
            Task(
                "calibration.chain.validation:plan_validation",
                "plan the validation: replicates at the optimum",
                reads=(*PLANNED, "validation"),
                inputs={"optimum": "optimise/optimum.json", "fixed": bench_values},
                plans="validation",
                seeds=4,
                expected=lambda config: config.validation.groups * config.validation.replicates,
            ),
            Task(
                "calibration.chain.validation:validation",
                "validation: replicates at the optimum against the measurement",
                reads=("validation", *TARGETS),
                inputs={"design": "validation/design.csv", "runs": Runs("validation")},
                outputs={
                    "summary": "validation/validation.json",
                    "runs": "validation/runs.csv",
                    "further_figures": PerTarget("validation/{}.svg", measured=True),
                    "figure": Figure(
                        "validation/validation.svg", "validation", ("runs.csv", "validation.json")
                    ),
                },
            ),
        ),
        tables=(("runs", "Replicates"),),
        sentences="calibration.chain.validation:sentences",
        pictured="validation",
    ),
)
