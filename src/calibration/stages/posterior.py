"""The parameters as a distribution, from the runs of the chain and the measured values."""

from calibration.stages.stage import TARGETS, Runs, Stage, Task

DESIGNS = ("ascent", "response_surface", "candidate", "validation")


def designs(study):
    """The designs whose runs count."""
    return [f"{study.folder}/{stage}/design.csv" for stage in DESIGNS]


STAGES = (
    Stage(
        name="posterior",
        title="Posterior",
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
                },
                cheap=False,
            ),
        ),
    ),
)
