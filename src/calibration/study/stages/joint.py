"""One posterior over all tests of the laboratory: a way to spend runs beside the chain's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.study.config.joint import joint_targets, joint_tests
from calibration.study.stages.stage import Figure, Plan, Stage
from dem.experiments import experiments

if TYPE_CHECKING:
    from calibration.study.config import Config


def runs_of(config: Config, rig: str) -> int:
    """Number of runs of a rig: the common design, what is repeated of it where runs scatter, and
    the points that are added where the rig has a target."""
    rules = config.joint
    twice = rules.repeated if experiments()[config.tests[rig].experiment].poured else 0
    return rules.runs + twice + _added(config, rig)


def _added(config, rig):
    asked = [*(r for t in joint_targets(config) for r in t.tests), config.joint.machine]
    return config.joint.second_wave if rig in asked else 0


def _first(config):
    """Runs that a study which waits for the stage plans first; none of another."""
    waits = joint_tests(config) if "joint" in config.supplements else ()
    return sum(runs_of(config, rig) - _added(config, rig) for rig in waits)


def _second(config):
    waits = joint_tests(config) if "joint" in config.supplements else ()
    return sum(_added(config, rig) for rig in waits)


STAGES = (
    Stage(
        name="joint",
        title="All tests together",
        place=5.3,
        # the second plan has the runs that the first ones ask for
        plans=(
            Plan("joint_first", expected=_first, every_rig=True),
            Plan("joint", expected=_second, every_rig=True),
        ),
        figures=(Figure("pairs", ("draws.csv", "joint.json")),),
        tables=(
            ("parameters", "Parameters with their 95 % intervals, by all targets"),
            (
                "targets",
                "Targets beside what the others expect; pull: the difference in sd",
            ),
            (
                "next",
                "What each further test tells; one nat leaves 37 % of what is open",
            ),
            ("predictions", "What is expected of each rig, and from which parameter"),
        ),
        sentences="calibration.chain.joint.words:sentences",
    ),
    Stage(
        name="joint_push_through",
        title="What all tests leave open, in other machines",
        place=5.4,
        plans=(Plan("joint_push_through"),),
        figures=(Figure("push_through", ("metrics.csv", "runs.csv")),),
        tables=(
            ("metrics", "Each metric over the draws"),
            ("shares", "Share of each metric's spread that goes with a parameter"),
        ),
        sentences="calibration.chain.joint.machines:sentences",
    ),
)
