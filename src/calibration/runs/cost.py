"""What a run costs, estimated from its spec before it is made: time of one core, and memory."""

import math
import os
from collections.abc import Mapping
from typing import Any

from dem.constants import GRAVITY
from dem.spec import RunSpec, parse_spec

BASE_MB, MB_PER_GRAIN = 250.0, 0.003
"""Memory of a run. Python with the compiled engine takes the first (a heap of 1,250 spheres took
206 MB), each grain the second: twice 160 bytes of state, about twelve neighbours of 45 bytes in two
lists, 1.4 kB together, and as much again for copies."""

GRAIN_STEPS_PER_S = 1.0e7
"""Of one core; a third of what a settled bed takes on the machine of the README."""

DROP_S, DROP_STEP_S = 0.3, 4.0e-6
"""What a run of single drops takes for its files, and for each step beside its grains; measured:
26,000 steps 0.3 s, 1.4 million 4.8 s, with one to five grains."""


def run_seconds(spec: Mapping[str, Any]) -> float | None:
    """Time of one run [s] of one core, estimated from its spec (a mapping); None for an experiment
    that neither pours grains nor drops single ones, and for another engine."""
    return seconds_of(parse_spec(spec))


def seconds_of(spec: RunSpec) -> float | None:
    """`run_seconds` of a `RunSpec`."""
    if spec.engine is not None:
        return None
    if spec.experiment == "drop":
        return _seconds_of_drops(spec)
    rate = getattr(spec.geometry, "generation_rate_per_s", None)
    if rate is None:
        return None
    from dem.experiments.setup import time_step_of  # loads the engine

    poured = spec.particles.count / rate
    # half of the grains on average while they are poured, all of them while they come to rest
    steps = (0.5 * poured + 0.7) / time_step_of(spec)
    return spec.particles.count * steps / GRAIN_STEPS_PER_S


def _seconds_of_drops(spec):
    from dem.experiments.setup import time_step_of  # loads the engine

    fall = math.sqrt(2e-3 * spec.geometry.drop_height_mm / GRAVITY)
    steps = 2.0 * fall / time_step_of(spec)  # the rebound takes no longer than the fall
    return DROP_S + steps * (DROP_STEP_S + spec.geometry.drops / GRAIN_STEPS_PER_S)


def memory_mb(count: float) -> float:
    """Memory [MB] of a run of `count` grains, estimated."""
    return BASE_MB + MB_PER_GRAIN * count


def machine_memory_mb() -> float:
    """Physical memory of this machine [MB]."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e6


def duration(seconds: float) -> str:
    """'40 s', '12 min', '3 h 20 min'."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
