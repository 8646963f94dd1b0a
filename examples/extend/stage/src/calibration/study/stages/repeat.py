"""The middle of all factors with several seeds."""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="repeat",
        title="How far runs of one point lie apart",
        place=7.6,
        plans=(Plan("repeat"),),
        figures=(Figure("spread_of_seeds", ("runs.csv",)),),
        tables=(("runs", "The runs"),),
        sentences="calibration.chain.repeat:sentences",
    ),
)
