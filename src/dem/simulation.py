"""A simulation as Python sees it: particles, walls, laws, and time."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from dem.constants import DOWN
from dem.contact.registry import Laws, PairProperties, attraction_reach, pair_properties
from dem.errors import BlowUpError, LightBodyError
from dem.grains import sphere
from dem.kernel import neighbours as nb
from dem.kernel.clusters import build_clusters, drop_clusters
from dem.kernel.simd import WIDTH
from dem.kernel.state import (
    GHOSTS,
    Clusters,
    Pairs,
    Particles,
    WallContacts,
    new_pairs,
    new_particles,
    new_wall_contacts,
    new_wall_scratch,
    no_clusters,
    place_ghosts,
)
from dem.kernel.step import DONE, OVERLAP, WALL_OVERLAP, Model, advance
from dem.kernel.threads import shares_of, threads_chosen
from dem.linear import into_axes, length
from dem.walls.builder import WallSet
from dem.walls.contacts import find_wall_contacts

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters, Material


CHECK_INTERVAL = 2000  # steps between searches for NaN
LEAPFROG = 4.0
"""Square of frequency times step up to which leapfrog is stable."""
YOUNG = PairProperties._fields.index("young")
NO_PAIR = -1  # row of the property table where two materials have no parameters


@dataclass(frozen=True)
class Air:
    """Still air: density [kg/m3] and dynamic viscosity [Pa s]."""

    density: float = 1.2
    viscosity: float = 1.8e-5


@dataclass(frozen=True)
class SkinPolicy:
    """How far a particle may travel before the pair list is made again.

    base: share of the radius, for grains at rest; horizon: number of steps of present speed.
    """

    base: float = 0.05
    horizon: int = 40


class Simulation:
    """Spheres, rigid clusters and walls under gravity.

    Parameters
    ----------
    materials : dict of str to Material; particles and walls name theirs.
    contacts : dict of (str, str) to ContactParameters; every pair that can meet must be there, in
        either order
    laws : Laws
    time_step : [s]
    gravity : (3,) [m/s2]
    precision : 'mixed' (float32 forces, exact separations) or 'double' (float64 throughout)
    walls : WallSet
    overlap_limit : share of the radius at which a run is stopped as blown up
    threads : number of threads, that of the environment unless given; the numbers do not depend
        on it

    Raises ValueError for laws that cannot be combined, for a time step of 0 or less, and when
    particles are added that can meet each other or a wall without parameters for that pair of
    materials.
    """

    def __init__(
        self,
        materials: Mapping[str, Material],
        contacts: Mapping[tuple[str, str], ContactParameters],
        *,
        laws: Laws | None = None,
        time_step: float,
        gravity: ArrayLike = DOWN,
        precision: str = "mixed",
        walls: WallSet | None = None,
        air: Air | None = None,
        overlap_limit: float = 0.2,
        skin: SkinPolicy | None = None,
        threads: int | str | None = None,
    ) -> None:
        self.threads = threads_chosen(threads)
        self.laws = laws or Laws()
        self.materials = dict(materials)
        self.material_names = list(self.materials)
        self.time_step = float(time_step)
        if not self.time_step > 0.0:
            raise ValueError(f"time_step {self.time_step:g} s; allowed: greater than 0")
        self.gravity = np.asarray(gravity, float)
        self.precision = precision
        self.walls = walls or WallSet()
        self.wall_state = self.walls.compile(self.material_names)
        self.overlap_limit = float(overlap_limit)
        self.skin = skin or SkinPolicy()
        self.kind_of = np.full((len(self.materials),) * 2, NO_PAIR, np.int32)
        self.properties = []  # type: list[PairProperties]
        for (a, x), (b, y) in combinations_with_replacement(enumerate(self.material_names), 2):
            pair = contacts.get((x, y)) or contacts.get((y, x))
            if pair is not None:
                self.kind_of[a, b] = self.kind_of[b, a] = len(self.properties)
                own = pair_properties(self.laws, self.materials[x], self.materials[y], pair)
                self.properties.append(own)
        if self.laws.drag != "none" and air is None:
            raise ValueError(f"laws.drag {self.laws.drag}: only with air")
        self.model = Model(
            codes=self.laws.codes(),
            table=np.array(self.properties, float),
            kind_of=self.kind_of,
            dt=self.time_step,
            gravity=self.gravity,
            air=np.array([air.density, air.viscosity] if air else [0.0, 0.0]),
            overlap_limit=self.overlap_limit,
        )
        self.n = self.steps = self.rebuilds = 0
        self.rebuild_seconds = self.advance_seconds = 0.0
        self.particles = new_particles(0, precision)
        self.clusters = no_clusters()
        self.row_of = np.zeros(0, np.int64)
        self._next_tag = self._pair_count = self._wall_count = 0
        self._team = None
        self._pairs, self._old_pairs = (new_pairs(64, precision) for _ in range(2))
        self._allowance = np.zeros(len(self.wall_state.mass))
        self._make_wall_room(64)
        self._renew_rows()

    # --- set-up -----------------------------------------------------------------------------------

    def _check_pairs(self, material, count):
        """Raise ValueError when `count` more grains of a material (its code) can meet what has no
        pair with it."""
        present = np.bincount(self.particles.material[: self.n], minlength=len(self.material_names))
        present[material] += count
        for other, name in enumerate(self.material_names):
            meets = present[other] > (1 if other == material else 0) or self.walls.uses(name)
            if meets and self.kind_of[material, other] == NO_PAIR:
                raise ValueError(
                    f"no contact parameters for {self.material_names[material]} and {name}"
                )

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.steps * self.time_step

    def add_particles(
        self,
        position: ArrayLike,
        radius: ArrayLike,
        *,
        velocity: ArrayLike = 0.0,
        spin: ArrayLike = 0.0,
        material: str | None = None,
    ) -> np.ndarray:
        """Add spheres.

        position (m, 3) [m]; radius (m,) or scalar [m]; velocity, spin (m, 3) or scalar [m/s],
        [rad/s]; material: a name, the first one by default. Returns their tags (m,). Raises
        ValueError for a radius of 0 or less, for two at one place, and for a material that can meet
        another without a pair of parameters.
        """
        position = np.atleast_2d(np.asarray(position, float))
        m = len(position)
        name = material or self.material_names[0]
        code = self.material_names.index(name)
        self._check_pairs(code, m)
        # float32 values, so that the sum of two radii is the same in both precisions
        radius = np.broadcast_to(np.asarray(radius, np.float32).astype(float), m)
        if not (radius > 0.0).all():
            raise ValueError(f"radius {radius.min():g} m; allowed: greater than 0")
        if len(np.unique(position, axis=0)) < m:
            raise ValueError("two particles have the same position: their contact has no normal")
        mass = sphere.mass(radius, self.materials[name].density)
        velocity = np.broadcast_to(np.asarray(velocity, float), (m, 3))
        spin = np.broadcast_to(np.asarray(spin, float), (m, 3))
        old, n = self.particles, self.n
        new = new_particles(n + m, self.precision)
        for a, b in zip(old, new, strict=True):
            b[:n] = a[:n]
        rows = slice(n, n + m)
        new.position[rows, :3], new.position[rows, 3] = position, radius
        new.kinetic[rows, 0:3] = velocity - 0.5 * self.time_step * self.gravity
        new.kinetic[rows, 3:6] = spin
        new.kinetic[rows, 6], new.kinetic[rows, 7] = radius, mass
        new.inverse[rows, 0], new.inverse[rows, 1] = 1.0 / mass, 1.0 / (0.4 * mass * radius**2)
        tags = np.arange(self._next_tag, self._next_tag + m)
        new.tag[rows], new.material[rows] = tags, code
        self._next_tag += m
        self.particles, self.n = new, n + m
        self._renew_rows()
        return tags

    def add_clusters(
        self,
        position: ArrayLike,
        radius: ArrayLike,
        *,
        velocity: ArrayLike = 0.0,
        mass: np.ndarray | None = None,
        inertia: np.ndarray | None = None,
        centre: np.ndarray | None = None,
        material: str | None = None,
    ) -> np.ndarray:
        """Add rigid bodies of bonded spheres.

        position (k, m, 3) [m]; radius (k, m) or scalar [m]; velocity (k, 3) or scalar [m/s]. Mass,
        inertia and centre of mass of a body are the sums over its spheres, an overlap counted once
        per sphere; or give mass (k,) [kg], inertia (k, 3, 3) about the centre of mass [kg m2] and
        centre (k, 3) [m]. Returns the tags (k, m). Raises ValueError as `add_particles`.
        """
        position = np.asarray(position, float)
        k, m = shape = position.shape[:2]
        velocity = np.broadcast_to(np.asarray(velocity, float), (k, 3))
        radius = np.broadcast_to(radius, shape)
        tags = self.add_particles(
            position.reshape(-1, 3),
            radius.reshape(-1),
            velocity=np.repeat(velocity, m, axis=0),
            material=material,
        )
        half_step_ago = velocity - 0.5 * self.time_step * self.gravity
        self.clusters = build_clusters(
            self.clusters, self.particles, self.n, shape, half_step_ago, mass, inertia, centre
        )
        return tags.reshape(shape)

    def remove(self, tags: np.ndarray) -> int:
        """Take grains out of the simulation, a cluster whole with any of its members; returns their
        number. tags (m,)."""
        if not len(tags):  # at most moments nothing leaves
            return 0
        gone = np.isin(self.particles.tag[: self.n], tags)
        if not gone.any():
            return 0
        number = int(gone.sum())
        if len(self.clusters.mass):
            number = self._remove_clusters(gone)
        keep = np.flatnonzero(~gone)
        new = new_particles(len(keep), self.precision)
        for a, b in zip(self.particles, new, strict=True):
            b[: len(keep)] = a[keep]
        new_row = np.full(self.n + GHOSTS, -1, np.int64)
        new_row[keep] = np.arange(len(keep))
        self._drop_contacts(new_row)
        self.particles, self.n = new, len(keep)
        self._renew_rows()
        return number

    def _remove_clusters(self, gone):
        """Drop the clusters of the rows in gone (n,), which then holds all of their rows; returns
        the number of grains gone, loose and bonded."""
        cluster = self.particles.cluster[: self.n]
        bonded = cluster >= 0
        keep = np.ones(len(self.clusters.mass), bool)
        keep[cluster[gone & bonded]] = False
        gone[bonded] = ~keep[cluster[bonded]]
        self.clusters = drop_clusters(self.clusters, keep)
        cluster[bonded] = (np.cumsum(keep) - 1)[cluster[bonded]]
        return int((gone & ~bonded).sum() + (~keep).sum())

    def _drop_contacts(self, new_row):
        """Renumber the lists' rows and forget the history of contacts whose particle is gone."""
        count = self._pair_count
        for array in (self._pairs.first, self._pairs.second):
            array[:count] = new_row[array[:count]]
        lost = (self._pairs.first[:count] < 0) | (self._pairs.second[:count] < 0)
        blocks, lanes = np.divmod(np.flatnonzero(lost), WIDTH)
        self._pairs.history[blocks, :, lanes] = 0.0
        walls = self._walls_list
        walls.particle[: self._wall_count] = new_row[walls.particle[: self._wall_count]]
        walls.history[: self._wall_count][walls.particle[: self._wall_count] < 0] = 0.0

    def _renew_rows(self):
        place_ghosts(self.particles, self.n)
        self._present_kinds = self._widest = None
        self._spare = new_particles(self.n, self.precision)
        self._stale = True

    def _make_wall_room(self, capacity):
        self._walls_list = new_wall_contacts(capacity)
        self._old_walls = new_wall_contacts(capacity)
        self._scratch = new_wall_scratch(capacity)

    # --- the lists --------------------------------------------------------------------------------

    def rebuild_lists(self) -> None:
        """Sort the particles in space and list the pairs and wall contacts that may touch."""
        begin = time.perf_counter()
        p, n, w = self.particles, self.n, self.wall_state
        horizon = self.skin.horizon * self.time_step
        nb.assign_skins(n, p, self.skin.base, horizon, float(length(self.gravity)))
        widest = self._attraction(n)
        reach, level, *grid = nb.plan_grids(n, p, 0.5 * widest)
        start, order = nb.counting_sort(n, p, level, *grid)
        reach, level, new_row = reach[order], level[order], np.arange(n + GHOSTS)
        nb.take_rows(n, p, order, self._spare, new_row)
        p, self._spare = self._spare, p
        self.particles = p  # sorted now
        self.row_of = np.full(self._next_tag, -1, np.int64)
        self.row_of[p.tag[:n]] = np.arange(n)
        for b in np.flatnonzero(w.unbounded & w.spin.any(axis=1)):
            # a turning plane sweeps past a grain the faster the further it is from the axis
            away = length(p.position[:n, :3] - w.origin[b]).max(initial=0.0)
            w.extent[b] = away + reach.max(initial=0.0)
        speed = length(w.velocity) + length(w.spin) * w.extent
        slack = self.skin.base * float(p.kinetic[:n, 6].min()) if n else 0.0
        self._allowance = np.where((speed > 0) | (w.mass > 0), horizon * speed + slack, 0.0)
        w.travel[:] = 0.0
        self._renew_pairs(reach, level, (*grid, start), new_row)
        self._renew_walls(reach, (*grid, start), new_row, 0.5 * widest)
        self._share_out()
        self.rebuilds += 1
        self._stale = False
        self.rebuild_seconds += time.perf_counter() - begin

    def _attraction(self, n):
        """Widest gap [m] that any contact can bridge."""
        if n == 0:
            return 0.0
        if self._widest is None:
            largest = float(self.particles.kinetic[:n, 6].max())
            self._widest = max(attraction_reach(self.laws, row, largest) for row in self.properties)
        return self._widest

    def _kinds(self):
        """Rows of the property table that two of the grains can have."""
        if self._present_kinds is None:
            present = np.flatnonzero(np.bincount(self.particles.material[: self.n]))
            kinds = np.unique(self.kind_of[np.ix_(present, present)])
            self._present_kinds = kinds[kinds != NO_PAIR]  # of a single grain with itself
        return self._present_kinds

    def _renew_pairs(self, reach, level, grid, new_row):
        old, old_count, new = self._pairs, self._pair_count, self._old_pairs
        while True:
            count = nb.find_pairs(
                self.n, self.particles, reach, level, *grid, self.kind_of, self._kinds(), new
            )
            if count <= len(new.first):
                break
            new = new_pairs(int(1.3 * count) + 64, self.precision)
        nb.carry_history(old, old_count, new, count, new_row)
        self._pairs, self._old_pairs, self._pair_count = new, old, count

    def _renew_walls(self, reach, grid, new_row, attraction):
        """attraction: what a wall's share of the widest gap adds to the grains' reach, which holds
        theirs [m]."""
        old, old_count, travel = self._walls_list, self._wall_count, self._allowance + attraction
        while True:
            count = find_wall_contacts(
                self.n, self.particles, self.wall_state, travel, reach, *grid, self._old_walls
            )
            if count <= len(self._old_walls.particle):
                break
            self._make_wall_room(int(1.3 * count) + 64)
        new = self._old_walls
        nb.carry_wall_history(old, old_count, new, count, new_row)
        if len(old.particle) != len(new.particle):
            old = new_wall_contacts(len(new.particle))
        self._walls_list, self._old_walls, self._wall_count = new, old, count

    def _share_out(self):
        """Say which thread does what until the lists are made again."""
        self._shares, self.particles = shares_of(
            self.threads, self.n, self.particles, self._pairs, self._pair_count, self._walls_list,
            self._wall_count, self._scratch,
        )  # fmt: skip

    # --- time -------------------------------------------------------------------------------------

    def advance(self, steps: int) -> None:
        """Advance by a number of steps. Raises BlowUpError when the run has become unphysical."""
        left, begin = int(steps), time.perf_counter()
        while left > 0:
            if self._stale:
                # a particle that is nowhere would be sorted into memory of others
                self._check_finite()
                self.rebuild_lists()
                self._check_free_bodies()
            done, status, contact = self._advance_shares(min(left, CHECK_INTERVAL))
            self.steps += done
            left -= done
            self._stale = status != DONE
            if status == OVERLAP:
                self._report_overlap(contact)
            if status == WALL_OVERLAP:
                self._report_wall_overlap(contact)
            if left == 0 or self.steps % CHECK_INTERVAL < done:
                self._check_finite()
        self.advance_seconds += time.perf_counter() - begin

    def _check_free_bodies(self):
        """Raise LightBodyError where a free body on the springs of its contacts, S_n = 2 E* a each,
        swings faster than the step can follow: S dt^2 > LEAPFROG M."""
        walls, count, held = self.wall_state, self._wall_count, self._walls_list
        if not (walls.mass > 0.0).any() or not count:
            return
        element = held.element[:count]
        kind = self.kind_of[self.particles.material[held.particle[:count]], walls.material[element]]
        stiffness = 2.0 * self.model.table[kind, YOUNG] * np.maximum(held.history[:count, 6], 0.0)
        spring = np.bincount(walls.body[element], stiffness, len(walls.mass))
        least = spring * self.time_step**2 / LEAPFROG
        for b in np.flatnonzero((walls.mass > 0.0) & (walls.mass < least)):
            name = self.walls.bodies[b]["name"]
            raise LightBodyError(
                f"wall {name!r} is free and weighs {walls.mass[b]:.3g} kg; under the grains that "
                f"it touches it needs {least[b]:.3g} kg at a time step of {self.time_step:.3g} s, "
                "or it is thrown: make it heavier, or the time step shorter"
            )

    def _advance_shares(self, steps):
        """`advance` on all threads at once, which all return the same."""
        what = (
            steps, self.model, self.particles, self._pairs, self.wall_state, self._walls_list,
            self._wall_count, self._allowance, self._scratch, self.clusters, self.row_of,
        )  # fmt: skip
        first, *others = self._shares
        if others and self._team is None:
            self._team = ThreadPoolExecutor(self.threads - 1)
        waiting = [self._team.submit(advance, *what, share) for share in others]
        out = advance(*what, first)
        for one in waiting:
            one.result()
        return out

    def _report_overlap(self, pair):
        last = min(pair + WIDTH, self._pair_count)
        i, j = self._pairs.first[pair:last], self._pairs.second[pair:last]
        p, k = self.particles.position[:, :3], self.particles.kinetic
        gap = length(p[i] - p[j]) - k[i, 6] - k[j, 6]
        worst = int(np.argmin(gap / np.minimum(k[i, 6], k[j, 6])))
        other = f"particle {self.particles.tag[j[worst]]}"
        self._raise_overlap(i[worst], -gap[worst], other, "each other")

    def _report_wall_overlap(self, contact):
        row, element = self._walls_list.particle[contact], self._walls_list.element[contact]
        depth = float(self.particles.kinetic[row, 6]) - self._scratch.distance[contact]
        name = self.walls.bodies[self.wall_state.body[element]]["name"]
        self._raise_overlap(row, depth, f"wall {name!r}", "a wall")

    def _raise_overlap(self, row, depth, other, inside):
        share = depth / float(self.particles.kinetic[row, 6])
        reason = f"overlap of {share:.2f} radii with {other} (limit {self.overlap_limit:g})"
        hint = "the time step is too large, the modulus too soft, the impact too fast, or "
        hint += f"particles were generated inside {inside}"
        raise self._blown_up(row, reason, hint)

    def _blown_up(self, row, reason, hint):
        tag = int(self.particles.tag[row])
        return BlowUpError(particle=tag, time=self.time, reason=reason, hint=hint)

    def _check_finite(self):
        row = nb.first_not_finite(self.n, self.particles)
        if row >= 0:
            reason = "position or velocity is not a number"
            hint = "the time step is too large for the contact stiffness"
            raise self._blown_up(row, reason, hint)

    # --- what can be seen -------------------------------------------------------------------------

    def _by_tag(self, array):
        return np.asarray(array[: self.n], float)[np.argsort(self.particles.tag[: self.n])]

    @property
    def tag(self) -> np.ndarray:
        """(n,) tags in ascending order: the order of all arrays below."""
        return np.sort(self.particles.tag[: self.n])

    @property
    def position(self) -> np.ndarray:
        """(n, 3) [m]."""
        return self._by_tag(self.particles.position)[:, :3]

    @property
    def velocity(self) -> np.ndarray:
        """(n, 3) [m/s], half a step behind the position."""
        return self._by_tag(self.particles.kinetic)[:, :3]

    @property
    def spin(self) -> np.ndarray:
        """(n, 3) angular velocity [rad/s], half a step behind the position."""
        return self._by_tag(self.particles.kinetic)[:, 3:6]

    @property
    def radius(self) -> np.ndarray:
        """(n,) [m]."""
        return self._by_tag(self.particles.kinetic)[:, 6]

    @property
    def mass(self) -> np.ndarray:
        """(n,) [kg]; the members of a cluster share its mass as their volumes."""
        mass = self._by_tag(self.particles.kinetic)[:, 7]
        if len(self.clusters.mass):
            _, grain = np.unique(self.grain, return_inverse=True)
            volume = self.radius**3
            mass *= volume / np.bincount(grain, volume)[grain]
        return mass

    @property
    def cubed_radius(self) -> np.ndarray:
        """(n,) cube of the radius of a sphere as large as each sphere's share of its grain [m3]."""
        cube = self.radius**3
        if not len(self.clusters.mass):
            return cube
        rows = np.argsort(self.particles.tag[: self.n])
        bonded = self.particles.cluster[rows] >= 0
        densities = np.array([self.materials[name].density for name in self.material_names])
        density = densities[self.particles.material[rows]]
        return np.where(bonded, self.mass / (4.0 / 3.0 * math.pi * density), cube)

    @property
    def grain(self) -> np.ndarray:
        """(n,) number of the grain that each sphere is part of: the lowest tag among those bonded
        together."""
        rows = np.argsort(self.particles.tag[: self.n])
        tag, cluster = self.particles.tag[rows], self.particles.cluster[rows]
        first = np.append(self.clusters.member[self.clusters.start[:-1]], -1)
        return np.where(cluster < 0, tag, first[cluster])

    @property
    def grain_count(self) -> int:
        """Number of grains, a cluster counted once."""
        return self.n - len(self.clusters.member) + len(self.clusters.mass)

    def kinetic_energy(self) -> float:
        """Energy of motion and spin of all loose particles and clusters [J]."""
        k, c = self.particles.kinetic[: self.n].astype(float), self.clusters
        k = k[self.particles.cluster[: self.n] < 0]
        inertia = 0.4 * k[:, 7] * k[:, 6] ** 2
        loose = (k[:, 7] * (k[:, :3] ** 2).sum(1) + inertia * (k[:, 3:6] ** 2).sum(1)).sum()
        turning = into_axes(c.rotation, c.momentum)
        bonded = (c.mass * (c.velocity**2).sum(1)).sum() + (turning**2 / c.inertia).sum()
        return 0.5 * float(loose + bonded)

    def contacts(self) -> tuple[np.ndarray, np.ndarray]:
        """Sphere contacts that transmit force: (m, 2) tags and (m, 3) tangential spring force on
        the first [N]."""
        blocks = self._pair_count // WIDTH
        held = (self._pairs.history[:blocks, 6, :] != 0.0).reshape(-1)
        tag = self.particles.tag
        rows = np.flatnonzero(held)
        ends = np.stack([tag[self._pairs.first[rows]], tag[self._pairs.second[rows]]], axis=1)
        spring = self._pairs.history[:blocks, :3, :].transpose(0, 2, 1).reshape(-1, 3)[rows]
        return ends, np.asarray(spring, float)

    @property
    def candidate_pairs(self) -> int:
        """Number of pairs that the list holds, touching or not."""
        return self._pair_count

    def wall_force(self, name: str) -> np.ndarray:
        """Force of the particles on a wall body at the last step (3,) [N]."""
        return self.wall_state.force[self.walls.index(name)].copy()

    def wall_impulse(self, name: str) -> np.ndarray:
        """Time integral of that force since the start (3,) [N s]; differences give mean forces."""
        return self.wall_state.impulse[self.walls.index(name)].copy()

    def wall_angular_impulse(self, name: str) -> np.ndarray:
        """Time integral of their torque about the body's origin since the start (3,) [N m s]."""
        return self.wall_state.angular_impulse[self.walls.index(name)].copy()

    def wall_origin(self, name: str) -> np.ndarray:
        """Position of a wall body's origin (3,) [m]."""
        return self.wall_state.origin[self.walls.index(name)].copy()

    def move_wall(
        self,
        name: str,
        *,
        velocity: ArrayLike | None = None,
        spin: ArrayLike | None = None,
        load: float | None = None,
    ) -> None:
        """Change a wall body's prescribed velocity (3,) [m/s], spin (3,) [rad/s] or load along its
        free axis [N]."""
        b, w = self.walls.index(name), self.wall_state
        if velocity is not None:
            w.velocity[b] = velocity
        if spin is not None:
            w.spin[b] = spin
        if load is not None:
            w.load[b] = load
        self._stale = True

    # --- checkpoint -------------------------------------------------------------------------------

    def state_dict(self) -> dict[str, np.ndarray]:
        """Everything that determines the future, as arrays for `numpy.savez`; see `restore`."""
        n, count = self.n, self._pair_count
        used: dict[str, Any] = {
            "particles": Particles(*(v[:n] for v in self.particles)),
            "walls": self.wall_state,
            "clusters": self.clusters,
            "pairs": Pairs(
                self._pairs.first[:count],
                self._pairs.second[:count],
                self._pairs.kind[: count // WIDTH],
                self._pairs.history[: count // WIDTH],
            ),
            "contacts": WallContacts(*(v[: self._wall_count] for v in self._walls_list)),
        }
        out = {f"{a}_{b}": v.copy() for a, of in used.items() for b, v in of._asdict().items()}
        counters = (self.steps, self.rebuilds, self._next_tag, count, self._wall_count, self._stale)
        own = {"allowance": self._allowance.copy(), "row_of": self.row_of.copy()}
        return out | own | {"counters": np.array(counters)}

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict` of a simulation that was set up alike; the future is the same
        to the bit."""
        self.steps, self.rebuilds, self._next_tag, pair_count, wall_count, stale = (
            int(v) for v in saved["counters"]
        )
        self.n = len(saved["particles_tag"])
        self.particles = new_particles(self.n, self.precision)
        self._renew_rows()
        room = (new_pairs(pair_count + 64, self.precision) for _ in range(2))
        self._pairs, self._old_pairs = room
        self._make_wall_room(wall_count + 64)
        own = {"particles": self.particles, "pairs": self._pairs, "contacts": self._walls_list}
        for name, arrays in own.items():
            for k, v in arrays._asdict().items():
                rows = saved[f"{name}_{k}"]
                v[: len(rows)] = rows
        for k, v in self.wall_state._asdict().items():
            v[:] = saved[f"walls_{k}"]
        self.clusters = Clusters(*(np.array(saved[f"clusters_{k}"]) for k in Clusters._fields))
        self._pair_count, self._wall_count = pair_count, wall_count
        self._allowance, self.row_of = np.array(saved["allowance"]), np.array(saved["row_of"])
        self._stale = bool(stale)
        self._share_out()
