"""Heap and drop enlarged by two rules, without and with cohesion."""

from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task

STAGES = (
    Stage(
        name="scaling",
        title="Scaling of the particles",
        category="Bench tests",
        place=7.5,
        about="What coarser particles change, and which rule keeps what.",
        unshown=("sd", "left_in_funnel"),
        tasks=(
            Task(
                "calibration.chain.scaling.plan:plan_scaling",
                "plan the scaling test: heap and drop, enlarged by two rules",
                reads=(*PLANNED, "scaling"),
                needs=("scaling",),
                plans="scaling",
                batches=4,
            ),
            Task(
                "calibration.chain.scaling.study:scaling",
                "scaling test: angle and rebound against scale, and what is said of them",
                reads=("run", "scaling"),
                needs=("scaling",),
                inputs={"design": "scaling/design.csv", "runs": Runs("scaling")},
                outputs={
                    "summary": "scaling/scaling.json",
                    "runs": "scaling/runs.csv",
                    "table": "scaling/scaling.csv",
                    "figure": Figure("scaling/scaling.svg", "scaling"),
                },
            ),
        ),
    ),
)
