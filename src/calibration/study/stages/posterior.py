"""The parameters as a distribution, from the runs of the chain and the measured values."""

from calibration.study.stages.stage import TARGETS, Figure, Runs, Stage, Task

DESIGNS = ("ascent", "response_surface", "candidate", "validation")


def designs(study):
    """The designs whose runs count."""
    return [f"{study.folder}/{stage}/design.csv" for stage in DESIGNS]


STAGES = (
    Stage(
        name="posterior",
        title="The parameters as a distribution",
        place=5.1,
        tasks=(
            Task(
                "calibration.chain.posterior:posterior",
                "posterior: the parameters as a distribution",
                reads=("seed", "posterior", *TARGETS),
                inputs={
                    "optimum": "optimise/optimum.json",
                    "designs": designs,
                    "validation": "validation/validation.json",
                    "runs": Runs("validation"),
                },
                outputs={
                    "summary": "posterior/posterior.json",
                    "draws": "posterior/draws.csv",
                    "parameters": "posterior/parameters.csv",
                    "next": "posterior/next.csv",
                    "pairs": Figure(
                        "posterior/pairs.svg", "posterior_pairs", ("draws.csv", "posterior.json")
                    ),
                    "pushed": Figure("posterior/pushed.svg", "posterior_pushed", ("draws.csv",)),
                    "following": Figure("posterior/next.svg", "posterior_next", ("next.csv",)),
                },
                cheap=False,
            ),
        ),
        tables=(
            ("parameters", "Parameters with their 95 % intervals"),
            ("next", "What each further measurement is expected to tell"),
        ),
        sentences="calibration.chain.posterior_words:sentences",
    ),
)
