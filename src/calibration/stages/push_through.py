"""Draws of a posterior, of one test or of all, pushed through other experiments or rigs."""

from typing import Any

from calibration.chain.push_through import sentences
from calibration.study.stage import Figure, Plan, Stage

SHOWN: Any = {
    "figures": (Figure("push_through", ("metrics.csv", "runs.csv")),),
    "tables": (
        ("metrics", "Each metric over the draws"),
        ("shares", "Share of each metric's spread that goes with a parameter"),
    ),
    "sentences": sentences,
}
"""What either shows."""

STAGES = (
    Stage(
        name="push_through",
        title="What stays open, in other machines",
        place=5.2,
        plans=(Plan("push_through"),),
        **SHOWN,
    ),
    Stage(
        name="joint_push_through",
        title="What all tests leave open, in other machines",
        place=5.4,
        plans=(Plan("joint_push_through"),),
        **SHOWN,
    ),
)
