"""What resolution, time step, modulus and rolling law cost in the response."""

from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task, bench_values

STAGES = (
    Stage(
        name="numerics",
        title="What the numerical choices cost",
        category="Numerics",
        place=11,
        about="Difference that resolution, time step, stiffness and rolling law make, with its 95 "
        "% interval: "
        "a choice whose interval holds zero, or that stays within the spread from seed to seed, "
        "does not "
        "matter here.",
        tasks=(
            Task(
                "calibration.chain.numerics:plan_numerics",
                "plan the study of resolution, time step, modulus and rolling law",
                reads=(*PLANNED, "numerics"),
                needs=("numerics",),
                inputs={
                    "variants": lambda study: study.config.numerics or [],
                    "fixed": bench_values,
                },
                plans="numerics",
            ),
            Task(
                "calibration.chain.numerics:numerics",
                "numerics: what the numerical choices cost",
                reads=("target",),
                inputs={"design": "numerics/design.csv", "runs": Runs("numerics")},
                outputs={
                    "table": "numerics/numerics.csv",
                    "figure": Figure("numerics/numerics.svg", "numerics"),
                },
            ),
        ),
    ),
)
