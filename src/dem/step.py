"""The time step, on one screen."""

from typing import NamedTuple

import numpy as np
from numba import njit

from dem.clusters import advance_clusters
from dem.contact.properties import LawCodes
from dem.drag import apply_drag
from dem.forces import clear_forces, pair_forces
from dem.integrate import advance_particles
from dem.walls.contacts import wall_forces
from dem.walls.motion import move_bodies

DONE, STALE, OVERLAP, WALL_OVERLAP = range(4)


class Model(NamedTuple):
    """What stays the same over a run."""

    codes: LawCodes
    table: np.ndarray
    """(kinds, N_PROPERTIES) properties of each pair of materials."""
    kind_of: np.ndarray
    """(materials, materials) int32 row of `table`."""
    dt: float
    """Time step [s]."""
    gravity: np.ndarray
    """(3,) [m/s2]."""
    air: np.ndarray
    """(2,) density [kg/m3] and viscosity [Pa s]; zeros in vacuum."""
    overlap_limit: float
    """Share of the radius at which a run counts as blown up [-]."""


@njit(cache=True, error_model="numpy")
def advance(
    steps, model, n, particles, pairs, pair_count, walls, wall_list, wall_count, allowance, scratch,
    clusters, row_of,
):  # fmt: skip
    """Advance up to `steps` steps; stop early when the lists are stale or an overlap is too large.

    Returns the steps done, DONE | STALE | OVERLAP | WALL_OVERLAP, and the pair or wall contact that
    overlaps too much or -1.
    """
    codes, table, kind_of, dt = model.codes, model.table, model.kind_of, model.dt
    for s in range(steps):
        clear_forces(n, particles.force)
        limit = model.overlap_limit
        excess = wall_forces(
            codes, table, kind_of, dt, particles, walls, wall_list, wall_count, scratch, limit
        )
        if excess >= 0:
            return s, WALL_OVERLAP, excess
        excess = pair_forces(codes, table, dt, particles, pairs, pair_count, limit)
        if excess >= 0:
            return s, OVERLAP, excess
        if model.air[0] > 0.0:
            apply_drag(n, particles, model.air[0], model.air[1])
        stale = advance_particles(n, particles, model.gravity, dt)
        stale |= advance_clusters(clusters, particles, row_of, model.gravity, dt)
        stale |= move_bodies(walls, model.gravity, dt, allowance)
        if stale:
            return s + 1, STALE, -1
    return steps, DONE, -1
