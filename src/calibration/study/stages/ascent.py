"""Steepest ascent: the region to look at closely."""

from calibration.study.stages.stage import PLANNED, TARGETS, Figure, Runs, Stage, Task, bench_values

STAGES = (
    Stage(
        name="ascent",
        title="Steepest ascent",
        place=2,
        tasks=(
            Task(
                "calibration.chain.ascent:plan_ascent",
                "plan the steepest ascent",
                reads=(*PLANNED, "ascent"),
                inputs={"screening": "screening/screening.json", "fixed": bench_values},
                plans="ascent",
                seeds=1,
                expected=lambda config: config.ascent.steps,
            ),
            Task(
                "calibration.chain.ascent:ascent",
                "steepest ascent: the region's centre",
                reads=("factors", "response_surface", *TARGETS),
                inputs={"design": "ascent/design.csv", "runs": Runs("ascent")},
                outputs={
                    "runs": "ascent/runs.csv",
                    "summary": "ascent/ascent.json",
                    "path": Figure("ascent/path.svg", "ascent", ("runs.csv",)),
                },
            ),
        ),
        tables=(("runs", "Path and results"),),
        sentences="calibration.chain.ascent:sentences",
        pictured="ascent",
    ),
)
