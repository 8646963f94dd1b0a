"""The parameters as a distribution, from the runs of the chain and the measured values."""

from calibration.chain.posterior_words import sentences
from calibration.study.stage import Figure, Stage

STAGES = (
    Stage(
        name="posterior",
        title="The parameters as a distribution",
        place=5.1,
        figures=(
            Figure("pairs", ("draws.csv", "posterior.json")),
            Figure("pushed", ("draws.csv",)),
            Figure("next", ("next.csv",)),
        ),
        tables=(
            ("parameters", "Parameters with their 95 % intervals"),
            (
                "next",
                "What each further measurement tells; one nat leaves 37 % of what is open",
            ),
        ),
        sentences=sentences,
    ),
)
