"""What a laboratory measures and sets, by plans.yaml: full plans of two to five levels a lever, and
further columns."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import yaml

SETTABLE: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("plans.yaml").read_text())
LEVELS, PLANS, FURTHER = SETTABLE["levels"], SETTABLE["plans"], SETTABLE["further"]
EXPERIMENTS = SETTABLE["experiments"]


def levers(
    experiment: str,
    plan: str,
    rng: np.random.Generator,
    column: str | None = None,
    frames: bool = False,
) -> dict[str, np.ndarray]:
    """{lever: (n,)} of a full plan, in the order of its levels.

    plan: of PLANS. column: of FURTHER, drawn for each row. frames: drops of two sizes are filmed at
    three frame intervals.
    """
    number, sizes = PLANS[plan]
    lever, *size = EXPERIMENTS[experiment]["levers"]
    counts = {lever: number} | dict.fromkeys(size, 2 if frames else sizes)
    counts |= {"output_interval_s": 3} if frames else {}
    rows = np.array(list(product(*(LEVELS[name][count] for name, count in counts.items()))))
    x = dict(zip(counts, rows.T, strict=True))
    if column:
        low, high = FURTHER[column]
        if column == "impact_number":  # it counts up, in an order of its own
            x[column] = rng.permutation(np.round(np.linspace(low, high, len(rows))))
        else:
            x[column] = np.round(rng.uniform(low, high, len(rows)), 1)
    return x
