"""What must hold at the end of each phase of an experiment; a phase of which it does not hold ends
the run with a sentence, and no number is read.

A static phase ends at rest: the grains move no more, and the walls carry their weight. Both are
needed. Grains at the top of their flight are slow, and grains that jam in a fall are carried by
nothing. A slope that is read at the end may stand long before the last grain rests: the run ends
then. All in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dem.constants import GRAVITY
from dem.errors import MeasureError, RefusedStateError
from dem.grains.sizes import fall_time
from dem.linear import length

if TYPE_CHECKING:
    from dem.simulation import Simulation
    from dem.spec import RunSpec

LOOK = 1.0  # between looks at the grains, in fall times of the mean grain
SOONEST = 5.0  # looks before grains may count as at rest: thrown grains are slow at their highest
CALM = 1e-4
"""Energy of motion over what lifts every grain by its radius: grains of this energy rise by a
ten-thousandth of their radius."""
CARRIED = 0.05
"""Of the weight: how far the mean force on the walls over a look may be from it. A bed that still
falls or packs is off by the acceleration of its grains over g."""

STANDS = 10.0  # looks over which a slope must stand: 0.1 s for grains of 2 mm
WITHIN = 0.1  # how far it may move meanwhile [deg]
STILL = 1e-2  # energy of motion below which a slope may stand
RESTS = 1e-5  # and below which it is read at once
REST, STOOD = "at rest", "its slopes stand"  # why a run ended that reads a slope


def look(spec: RunSpec) -> float:
    """Time [s] between two looks at the grains."""
    return LOOK * fall_time(spec)


def motion(sim: Simulation) -> float:
    """Energy of motion, spins left out, over what lifts every grain, and what presses on them, by
    the grains' radius [-].

    Loose grains may spin on. Pressed grains rest against the load, of which their weight is a small
    part.
    """
    mass, velocity = sim.mass, sim.velocity
    energy = 0.5 * float((mass * (velocity * velocity).sum(1)).sum())
    lift = GRAVITY * float((mass * sim.radius).sum())
    if not lift:
        return 0.0  # no grain moves where all have spilled
    # the mass whose weight is the load: of the free walls, and of what presses on them
    walls = sim.wall_state
    down = (walls.axis * sim.gravity).sum(1) / max(float(length(sim.gravity)), 1e-300)
    loads = (down * down * walls.mass + down * walls.load / GRAVITY)[walls.mass > 0.0]
    pressing = max(float(loads.sum()), 0.0)  # none where they are held up
    return energy / lift / (1.0 + pressing / float(mass.sum()))


def over_weight(sim: Simulation, force: np.ndarray) -> float | None:
    """Part of a force (3,) [N] along gravity over the weight of all grains [-]; None without grains
    or gravity."""
    strength = float(length(sim.gravity))
    weight = float(sim.mass.sum()) * strength if sim.n else 0.0
    return float((force * sim.gravity).sum()) / (weight * strength) if weight else None


def rest(sim: Simulation, spec: RunSpec, limit: float, phase: str) -> None:
    """Wait until the grains rest. Raises RefusedStateError where they do not within `limit` [s].

    phase: what ends, for the sentence. They rest below a `motion` of CALM; a state that moves no
    more but is not carried yet is waited for.
    """
    start, pause, moved, load = sim.time, look(spec), np.nan, np.nan
    while sim.time - start < limit:
        before, begin = sim.wall_state.impulse.sum(0), sim.time
        sim.advance(max(round(pause / sim.time_step), 1))
        if sim.time - start <= SOONEST * pause:
            continue
        moved = motion(sim)
        if moved >= CALM:
            continue
        force = (sim.wall_state.impulse.sum(0) - before) / (sim.time - begin)
        load = float(over_weight(sim, force))  # type: ignore[arg-type]  # 1 at rest
        if abs(load - 1.0) < CARRIED:
            return
    refuse(phase, sim.time - start, moved, load)


class Slopes:
    """Slopes that a run waits for, as they were seen over time: rows (time [s], angles [deg])."""

    def __init__(self, spec: RunSpec, seen: Iterable[Sequence[float]] = ()) -> None:
        self.span, self.seen = STANDS * look(spec), [list(row) for row in seen]

    def ended(
        self, sim: Simulation, read: Callable[[], Sequence[float]], calm: float = RESTS
    ) -> str:
        """REST where the grains' `motion` is below `calm`, STOOD where each angle of read() [deg]
        has stayed WITHIN over STANDS looks of grains that are STILL; empty where neither holds."""
        moved = motion(sim)
        if moved < calm:
            return REST
        if moved >= STILL:
            self.seen.clear()
        elif not self.seen or sim.time - self.seen[-1][0] >= 0.25 * self.span:
            try:
                self.seen.append([sim.time, *read()])
            except MeasureError:  # no slope yet
                self.seen.clear()
            if self.seen and sim.time - self.seen[0][0] >= self.span:
                if np.ptp(np.array(self.seen)[:, 1:], axis=0).max() <= WITHIN:
                    return STOOD
                del self.seen[0]
        return ""


def refuse(phase: str, waited: float, moved: float, load: float, calm: float = CALM) -> None:
    """Raise RefusedStateError for a phase whose grains do not rest."""
    found = f"after {waited:.3g} s "
    if np.isnan(moved):
        found = f"{waited:.3g} s are too short to tell"
    elif moved >= calm:
        found += f"they move with {moved:.1e} of the energy that lifts them by a radius; at rest "
        found += f"they have less than {calm:.0e}"
    else:
        found += f"the walls carry {load:.3g} of their weight; at rest 1 to within {CARRIED:g}"
    raise RefusedStateError(
        "restless",
        f"{phase}: the grains are not at rest: {found}; give numerics.max_time_s more, or lower "
        "numerics.rayleigh_fraction where pressed grains tremble",
    )
