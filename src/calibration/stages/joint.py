"""The parameters as a distribution: of one test from the chain's runs, of all tests from runs of
their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calibration.chain.joint import words
from calibration.study.config.joint import joint_tests, refined_tests
from calibration.study.stage import Figure, Plan, Stage
from dem.experiments import experiments

if TYPE_CHECKING:
    from calibration.study.config import Config


def _first(config: Config) -> int:
    """Runs that a study which waits for the stage plans first, none of another: the common design
    of each test, and what is repeated of it where runs scatter."""
    waits = joint_tests(config) if "joint" in config.supplements else ()
    scatter = [experiments()[config.tests[name].experiment].poured for name in waits]
    return config.joint.runs * len(scatter) + config.joint.repeated * sum(scatter)


def _second(config: Config) -> int:
    """Runs that are added where the posterior is wide."""
    waits = refined_tests(config) if "joint" in config.supplements else ()
    return config.joint.second_wave * len(waits)


SHOWN: Any = {
    "figures": (Figure("pairs", ("draws.csv", "parameters.csv")),),
    "tables": (
        ("parameters", "Parameters with their 95 % intervals"),
        ("targets", "Targets beside what the others expect; pull: the difference in sd"),
        ("next", "What each further test tells; one nat leaves 37 % of what is open"),
        ("predictions", "What is expected of each test, and from which parameter"),
    ),
    "sentences": words.sentences,
}
"""What either posterior shows."""

STAGES = (
    Stage(name="posterior", title="The parameters as a distribution", place=5.1, **SHOWN),
    Stage(
        name="joint",
        title="All tests together",
        place=5.3,
        # the second plan has the runs that the first ones ask for
        plans=(
            Plan("joint_first", expected=_first, every_rig=True),
            Plan("joint", expected=_second, every_rig=True),
        ),
        **SHOWN,
    ),
)
