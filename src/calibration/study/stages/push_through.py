"""Draws of the posterior pushed through other experiments or rigs."""

from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task, bench_values

NEEDS = ("push_through",)

STAGES = (
    Stage(
        name="push_through",
        title="What stays open, in other machines",
        place=5.2,
        tasks=(
            Task(
                "calibration.chain.push_through:plan_push_through",
                "plan the draws of the posterior in other machines",
                reads=(*PLANNED, *NEEDS),
                needs=NEEDS,
                inputs={"draws": "posterior/draws.csv", "fixed": bench_values},
                plans="push_through",
                seeds=5,
            ),
            Task(
                "calibration.chain.push_through:push_through",
                "what the posterior leaves open in other machines",
                reads=("experiment", "run", "measurements", *NEEDS),
                needs=NEEDS,
                inputs={"design": "push_through/design.csv", "runs": Runs("push_through")},
                outputs={
                    "summary": "push_through/push_through.json",
                    "metrics": "push_through/metrics.csv",
                    "runs": "push_through/runs.csv",
                    "figure": Figure(
                        "push_through/push_through.svg",
                        "push_through",
                        ("metrics.csv", "runs.csv"),
                    ),
                },
            ),
        ),
        tables=(("metrics", "Each metric over the draws"),),
        sentences="calibration.chain.push_through:sentences",
    ),
)
