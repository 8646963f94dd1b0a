"""The energy ledger of a simulation: where the energy of its grains comes from and goes to.

    kinetic + potential + elastic + dissipated = walls + source + what there was

It follows a simulation step by step and works out each contact again beside the engine, in float64.
What a contact takes up is its force and torque times the motion of its two bodies; of that its
springs hold the elastic part, and the rest is dissipated. So the ledger closes where a force acts
on both bodies alike, torques go with their arms, walls feel what grains feel, and a step keeps what
it integrates. And a law that creates energy dissipates less than nothing.

Velocities are those of the half steps (`dem.kernel.integrate`): energies of motion and of height
are taken there, and the power of a force with the mean of the velocities before and after it. A
ledger costs some ten times the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from dem.contact.dispatch import reach, rolling, spans_gap, tangential, torsion
from dem.contact.model import INERTIA, normal_force, pair_contact, pair_is_active, pair_overlap
from dem.contact.row import properties_of
from dem.kernel.arithmetic import cross, dot
from dem.kernel.simd import WIDTH

if TYPE_CHECKING:
    from dem.simulation import Simulation


NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
SMALL = 1e-9
"""Slip [m] and turn [rad] by which the stiffness of a spring is tried."""
ENDLESS = 1e30  # N: a limit that no spring meets


@dataclass(frozen=True)
class Energies:
    """What a ledger holds [J].

    kinetic, potential, elastic : now, of grains and free walls
    dissipated : in contacts, in air and in the drag of free walls, since the ledger was begun
    walls : work of the walls and of the loads on free ones
    source : what was added, taken away or set in motion between calls of `Ledger.advance`
    """

    kinetic: float
    potential: float
    elastic: float
    dissipated: float
    walls: float
    source: float

    @property
    def held(self) -> float:
        """Kinetic, potential and elastic energy [J]."""
        return self.kinetic + self.potential + self.elastic


class Ledger:
    """Follows a `Simulation` from before its first contact; it is advanced by `advance` alone."""

    def __init__(self, simulation: Simulation) -> None:
        self.sim = simulation
        self._elastic = self._dissipated = self._walls = self._source = 0.0
        self._turned_over = 0.0
        self._begin = self._last = self._held()

    @property
    def energies(self) -> Energies:
        """The `Energies` of now."""
        kinetic, potential = motion_and_height(self.sim)
        return Energies(
            kinetic, potential, self._elastic, self._dissipated, self._walls, self._source
        )

    @property
    def error(self) -> float:
        """Energy that the ledger does not account for, over all that it has booked [-]."""
        e = self.energies
        missing = e.held + e.dissipated - e.walls - e.source - self._begin
        return missing / max(self._turned_over, 1e-300)

    def advance(self, steps: int) -> None:
        """Advance the simulation by a number of steps and book each."""
        given = self._held() - self._last
        self._source += given
        self._turned_over += abs(given)
        for _ in range(int(steps)):
            self._step()
        self._last = self._held()

    def _held(self):
        return sum(motion_and_height(self.sim)) + self._elastic

    def _step(self):
        sim = self.sim
        if sim._stale:
            sim.rebuild_lists()
        begin = _Begin(sim)
        sim.advance(1)
        done = _Done(sim, begin)
        taken, elastic = done.pairs()
        more, stored, given = done.walls()
        lost = done.resisted() + done.dragged() + done.braked()
        released = taken + more + (self._elastic - elastic - stored)
        self._elastic = elastic + stored
        self._dissipated += released + lost
        self._walls += given
        self._turned_over += abs(taken) + abs(more) + abs(given) + abs(lost)


def motion_and_height(sim: Simulation) -> tuple[float, float]:
    """(kinetic, potential) energy [J] of grains and free walls, both half a step ago."""
    walls = sim.wall_state
    free = walls.mass > 0.0
    kinetic = sim.kinetic_energy()
    kinetic += 0.5 * float((walls.mass * (walls.velocity**2).sum(1))[free].sum())
    half = 0.5 * sim.time_step
    loose = sim.particles.cluster[: sim.n] < 0
    k = sim.particles.kinetic[: sim.n].astype(float)[loose]
    c = sim.clusters
    potential = 0.0
    for mass, place, velocity in (
        (k[:, 7], sim.particles.position[: sim.n, :3][loose], k[:, :3]),
        (c.mass, c.position, c.velocity),
        (walls.mass[free], walls.origin[free], walls.velocity[free]),
    ):
        middle = place - half * velocity
        potential -= float((mass[:, None] * middle * sim.gravity).sum())
    return kinetic, potential


class _Begin:
    """What a step begins with."""

    def __init__(self, sim):
        self.position = sim.particles.position[:, :3].copy()
        self.kinetic = sim.particles.kinetic.astype(float)
        self.springs = sim._pairs.history.astype(float)
        walls = sim.wall_state
        self.origin, self.velocity = walls.origin.copy(), walls.velocity.copy()
        self.middle, self.momentum = sim.clusters.position.copy(), sim.clusters.momentum.copy()


class _Done:
    """What a step has done, beside what it began with."""

    def __init__(self, sim, begin):
        self.sim, self.begin = sim, begin
        self.after = sim.particles.kinetic.astype(float)
        self.mean = 0.5 * (begin.kinetic + self.after)
        self.force = np.zeros_like(self.mean)

    def pairs(self) -> tuple[float, float]:
        """(energy taken up in the step, elastic energy now) of the contacts of grains [J]."""
        sim, begin = self.sim, self.begin
        return _pairs(
            sim.model.codes, sim.model.table, sim.time_step, sim._pairs.first, sim._pairs.second,
            sim._pairs.kind, sim._pair_count, begin.springs, begin.position, begin.kinetic,
            self.mean, self.force,
        )  # fmt: skip

    def walls(self) -> tuple[float, float, float]:
        """(energy taken up, elastic energy now, work of the walls) of the contacts with walls
        [J]."""
        sim, begin, state, held = self.sim, self.begin, self.sim.wall_state, self.sim._walls_list
        count, scratch, dt = sim._wall_count, sim._scratch, sim.time_step
        on = scratch.acts[:count]
        i, e = held.particle[:count][on], held.element[:count][on]
        b = state.body[e]
        push, turn, arm = (a[:count][on] for a in (scratch.push, scratch.turn, scratch.point))
        velocity = 0.5 * (begin.velocity + state.velocity)
        to_point = begin.origin[b] + arm - begin.position[i]
        torque = turn + np.cross(to_point, push)
        np.add.at(self.force[:, :3], i, push)
        np.add.at(self.force[:, 3:6], i, torque)
        on_grains = dt * float((push * self.mean[i, :3] + torque * self.mean[i, 3:6]).sum())
        # the engine's own sums of what its bodies feel
        power = (state.force * velocity).sum(1) + (state.torque * state.spin).sum(1)
        on_walls = dt * float(power.sum())
        free = state.mass > 0.0
        load = (state.load[:, None] * state.axis * velocity)[free].sum()
        given = -dt * float(power[~free].sum()) + dt * float(load)
        stored = _stored_at_walls(
            sim.model.codes, sim.model.table, sim.kind_of, dt, i, e, sim.particles.material,
            state.material, scratch.distance[:count][on], held.history[:count][on], begin.kinetic,
        )  # fmt: skip
        return -(on_grains + on_walls), stored, given

    def resisted(self) -> float:
        """Energy [J] that the torque on grains' own spin takes."""
        sim, dt = self.sim, self.sim.time_step
        rows = np.flatnonzero(
            (sim.particles.force[: sim.n, 6] > 0.0) & (sim.particles.cluster[: sim.n] < 0)
        )
        inertia = INERTIA * self.mean[rows, 7] * self.mean[rows, 6] ** 2
        free = self.begin.kinetic[rows, 3:6] + dt / inertia[:, None] * self.force[rows, 3:6]
        taken = free - self.after[rows, 3:6]
        lost = float((inertia[:, None] * taken * self.mean[rows, 3:6]).sum())
        return lost + (self._resisted_by_bonded() if len(sim.clusters.mass) else 0.0)

    def _resisted_by_bonded(self):
        sim, c = self.sim, self.sim.clusters
        rows, of = sim.row_of[c.member], np.repeat(np.arange(len(c.mass)), np.diff(c.start))
        arm = self.begin.position[rows] - self.begin.middle[of]
        torque = np.zeros_like(c.momentum)
        np.add.at(torque, of, self.force[rows, 3:6] + np.cross(arm, self.force[rows, :3]))
        taken = self.begin.momentum + sim.time_step * torque - c.momentum
        resisted = np.bincount(of, sim.particles.force[rows, 6]) > 0.0
        spin = self.mean[rows[c.start[:-1]], 3:6]
        return float((taken * spin)[resisted].sum())

    def dragged(self) -> float:
        """Energy [J] that the air takes."""
        sim = self.sim
        if sim.model.air[0] == 0.0:
            return 0.0
        drag = sim.particles.force[: sim.n, :3].astype(float) - self.force[: sim.n, :3]
        return -sim.time_step * float((drag * self.mean[: sim.n, :3]).sum())

    def braked(self) -> float:
        """Energy [J] that the drag of free walls takes."""
        state, begin = self.sim.wall_state, self.begin
        mean = 0.5 * (begin.velocity + state.velocity)
        braking = state.drag[:, None] * (state.axis * (state.axis * state.velocity).sum(1)[:, None])
        return self.sim.time_step * float((braking * mean)[state.mass > 0.0].sum())


@njit(cache=True, error_model="numpy")
def _pairs(codes, table, dt, first, second, kind, count, springs, x, before, mean, force):
    """Energy that pairs take up in a step and elastic energy that they hold at its end [J]; adds
    their forces and torques to force (n, 8)."""
    taken = stored = 0.0
    for k in range(count):
        i, j, h = first[k], second[k], springs[k // WIDTH]
        lane = k % WIDTH
        a, b = before[i], before[j]
        p = properties_of(table, kind[k // WIDTH])
        separation = (x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2])
        overlap, inverse = pair_overlap(separation, a[6], b[6])
        if not pair_is_active(codes, p, overlap, a[6], b[6], h[6, lane]):
            continue
        history = (
            h[0, lane], h[1, lane], h[2, lane], h[3, lane], h[4, lane], h[5, lane], h[6, lane],
            h[7, lane], h[8, lane],
        )  # fmt: skip
        on_i, on_j, history = pair_contact(
            codes, p, dt, separation, inverse, overlap,
            (a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]),
            (b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]), history,
        )  # fmt: skip
        for f in range(6):
            taken -= dt * (on_i[f] * mean[i, f] + on_j[f] * mean[j, f])
            force[i, f] += on_i[f]
            force[j, f] += on_j[f]
        r_eff, m_eff = a[6] * b[6] / (a[6] + b[6]), a[7] * b[7] / (a[7] + b[7])
        own, other = INERTIA * a[7] * a[6] ** 2, INERTIA * b[7] * b[6] ** 2
        inertia = own * other / (own + other)
        n = (separation[0] * inverse, separation[1] * inverse, separation[2] * inverse)
        stored += _stored(codes, p, dt, overlap, n, r_eff, 2.0 * r_eff, m_eff, inertia, history)
    return taken, stored


@njit(cache=True, error_model="numpy")
def _stored_at_walls(codes, table, kind_of, dt, rows, elements, material, other, gap, springs, k):
    """Elastic energy of contacts with walls [J]."""
    stored = 0.0
    for c in range(len(rows)):
        i, h = rows[c], springs[c]
        r, m = k[i, 6], k[i, 7]
        p = properties_of(table, kind_of[material[i], other[elements[c]]])
        history = (h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8])
        n = _across((h[0], h[1], h[2]))
        stored += _stored(codes, p, dt, r - gap[c], n, r, r, m, INERTIA * m * r * r, history)
    return stored


@njit(cache=True, error_model="numpy")
def _across(spring):
    """A unit vector across a spring (3,): which one makes no difference to its energy."""
    x, y, z = spring
    n = (y, -x, 0.0) if abs(x) + abs(y) > abs(z) else (0.0, z, -y)
    size = np.sqrt(dot(n, n))
    return (n[0] / size, n[1] / size, n[2] / size) if size > 0.0 else (0.0, 0.0, 1.0)


@njit(cache=True, error_model="numpy")
def _stored(codes, p, dt, overlap, n, r_eff, grain, m_eff, inertia, history):
    """Elastic energy of a contact [J]: what its normal force gives back on the way out, without
    motion, and what its springs hold at their present stiffness."""
    radius = history[6]
    if radius == 0.0:
        return 0.0
    out = 0.0
    if spans_gap(codes):
        out = -reach(codes, p, r_eff, grain)
    held, span = 0.0, overlap - out
    for q in range(len(NODES)):
        s = 0.5 * (1.0 + NODES[q])
        at = out + span * s * s
        force, _, _, _, _ = normal_force(codes, p, at, r_eff, grain, m_eff, 0.0, history[7])
        held += WEIGHTS[q] * s * span * force
    _, _, a, stiffness, _ = normal_force(codes, p, overlap, r_eff, grain, m_eff, 0.0, history[7])
    if a <= 0.0:
        return held
    zero = (0.0, 0.0, 0.0)
    t = _perpendicular(n)
    rate = SMALL / dt
    along = (rate * t[0], rate * t[1], rate * t[2])
    _, spring = tangential(codes, p, n, along, stiffness, a, a, m_eff, zero, ENDLESS, dt)
    held += _of_spring(history[0] ** 2 + history[1] ** 2 + history[2] ** 2, spring)
    _, moment = rolling(codes, p, n, along, ENDLESS, stiffness, 1.0, r_eff, inertia, zero, dt)
    held += _of_spring(history[3] ** 2 + history[4] ** 2 + history[5] ** 2, moment)
    _, twist = torsion(codes, p, rate, a, 1.0, m_eff, 0.0, ENDLESS, dt)
    return held + _of_spring(history[8] ** 2, (twist, 0.0, 0.0))


@njit(cache=True, error_model="numpy")
def _of_spring(square, tried):
    """Energy of a spring whose force or moment has this square, from what a motion by SMALL makes
    of it."""
    stiffness = np.sqrt(dot(tried, tried)) / SMALL
    return 0.5 * square / stiffness if stiffness > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _perpendicular(n):
    """A unit vector across a unit vector."""
    c = cross(n, (0.0, 0.0, 1.0)) if abs(n[2]) < 0.7 else cross(n, (1.0, 0.0, 0.0))
    size = np.sqrt(dot(c, c))
    return (c[0] / size, c[1] / size, c[2] / size)
