"""The response over the rate of the pour, and out of the opened funnel."""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="pour_rate",
        title="How fast the grains arrive",
        place=7.5,
        plans=(Plan("pour_rate"),),
        figures=(Figure("pour_rate", ("rates.csv", "runs.csv")),),
        tables=(("rates", "Rates and rigs"),),
        sentences="calibration.chain.pour_rate:sentences",
    ),
)
