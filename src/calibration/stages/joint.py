"""The parameters as a distribution: of one test from the chain's runs, of all tests from runs of
their own."""

from __future__ import annotations

from typing import Any

import pandas as pd

from calibration.chain.joint import words
from calibration.study.config.joint import joint_factors, joint_tests, refined_tests
from calibration.study.stage import Figure, Plan, Points, Stage


def _first(config, factors):
    """The common design of each test and what is repeated of it, where the study waits for them."""
    if "joint" not in config.supplements:
        return []
    from calibration.chain.joint.plans import first_points  # loads what samples a posterior

    d = len(joint_factors(config, factors))
    return [_points(config, n, len(first_points(config, n, d))) for n in joint_tests(config)]


def _second(config, factors):
    """Runs that are added where the posterior is wide, where the study waits for them."""
    waits = refined_tests(config) if "joint" in config.supplements else ()
    return [_points(config, name, config.joint.second_wave) for name in waits]


def _points(config, name, count):
    run, experiment = config.run_of(name), config.tests[name].experiment
    return Points(f"tests.{name}", pd.DataFrame(index=range(count)), experiment, run)


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
            Plan("joint_first", ahead=_first, every_rig=True),
            Plan("joint", ahead=_second, every_rig=True),
        ),
        **SHOWN,
    ),
)
