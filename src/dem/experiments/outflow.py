"""What leaves a vessel through an opening: mass over time, and the steady flow. All in SI."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from dem.errors import MeasureError
from dem.experiments import bed, phases
from dem.linear import slope
from dem.simulation import Simulation

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec  # which loads the experiments, and they this

STEADY = 0.1, 0.4  # shares of the mass that leaves, between which the flow is read
QUIET = 15  # looks without a grain leaving: the flow has ended


def watch(
    sim: Simulation,
    spec: RunSpec,
    leave: Callable[[], float],
    context: RunContext | None = None,
    share: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] from now on and the mass [kg] that has left by then, until nothing leaves any more.

    leave: leave() -> mass [kg] that has left since the last call; context: told of each look,
    `share` of the run in all. Raises MeasureError where grains still leave at the spec's end.
    """
    times, masses, quiet, start = [0.0], [0.0], 0, sim.time
    total, limit = float(sim.mass.sum()), spec.numerics.max_time_s
    while sim.n and quiet < QUIET:
        if times[-1] > limit:
            more = "give numerics.max_time_s more, widen the opening, or take fewer grains"
            raise MeasureError(f"grains still leave after {limit:g} s; {more}")
        bed.advance_for(sim, phases.look(spec))
        gone = leave()
        times.append(sim.time - start)
        masses.append(masses[-1] + gone)
        quiet = 0 if gone > 0.0 else quiet + 1
        if context:
            context.progress(0.3 + share * masses[-1] / total, f"{sim.time:.2f} s")
            context.frame(sim)
    return np.array(times), np.array(masses)


def steady_flow(times: np.ndarray, masses: np.ndarray) -> float:
    """Flow [kg/s] between the shares STEADY of the mass that leaves; 0 where nothing does.

    What leaves in a few looks is its mass over its time. times (m,) [s], masses (m,) [kg].
    """
    if masses[-1] <= 0.0:
        return 0.0
    share = masses / masses[-1]
    steady = (share > STEADY[0]) & (share < STEADY[1])
    if steady.sum() > 2:
        return slope(times[steady], masses[steady])
    return float(masses[-1] / ended(times, masses))


def ended(times: np.ndarray, masses: np.ndarray) -> float:
    """Time [s] of the first look at which all that leaves has left. times (m,) [s], masses (m,)
    [kg]."""
    return float(times[int(np.argmax(masses >= masses[-1]))])
