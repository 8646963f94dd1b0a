"""Draws of the posterior pushed through other experiments or rigs."""

from calibration.chain.push_through import sentences
from calibration.study.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="push_through",
        title="What stays open, in other machines",
        place=5.2,
        plans=(Plan("push_through"),),
        figures=(Figure("push_through", ("metrics.csv", "runs.csv")),),
        tables=(("metrics", "Each metric over the draws"),),
        sentences=sentences,
    ),
)
