"""Steepest ascent: the region to look at closely."""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="ascent",
        title="Steepest ascent",
        place=2,
        plans=(Plan("ascent", expected=lambda config: config.ascent.steps),),
        figures=(Figure("path", ("runs.csv",)),),
        tables=(("runs", "Path and results"),),
        sentences="calibration.chain.ascent:sentences",
        pictured="ascent",
    ),
)
