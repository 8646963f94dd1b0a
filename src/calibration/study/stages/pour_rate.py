"""The response over the rate of the pour, and out of the opened funnel."""

from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task, bench_values

NEEDS = ("pour_rate",)

STAGES = (
    Stage(
        name="pour_rate",
        title="How fast the grains arrive",
        category="Pour rate",
        place=7.5,
        tasks=(
            Task(
                "calibration.chain.pour_rate:plan_pour_rate",
                "plan heaps at other pour rates",
                reads=(*PLANNED, *NEEDS),
                needs=NEEDS,
                inputs={"optimum": "optimise/optimum.json", "fixed": bench_values},
                plans="pour_rate",
                seeds=6,
            ),
            Task(
                "calibration.chain.pour_rate:pour_rate",
                "the response over the pour rate",
                reads=("target", "experiment", "run", *NEEDS),
                needs=NEEDS,
                inputs={"design": "pour_rate/design.csv", "runs": Runs("pour_rate")},
                outputs={
                    "summary": "pour_rate/pour_rate.json",
                    "table": "pour_rate/rates.csv",
                    "runs": "pour_rate/runs.csv",
                    "figure": Figure(
                        "pour_rate/pour_rate.svg", "pour_rate", ("rates.csv", "runs.csv")
                    ),
                },
            ),
        ),
        tables=(("rates", "Rates and rigs"),),
        sentences="calibration.chain.pour_rate:sentences",
    ),
)
