"""The time step, on one screen."""

from typing import NamedTuple

import numpy as np
from numba import njit

from dem.contact.registry import LawCodes
from dem.kernel.clusters import advance_clusters
from dem.kernel.drag import apply_drag
from dem.kernel.integrate import advance_particles
from dem.kernel.pair_forces import pair_forces
from dem.kernel.threads import PAIR, STALE_LIST, WALL, add_kept, clear_forces, highest, meet
from dem.walls.contacts import load_bodies, wall_forces
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


@njit(cache=True, error_model="numpy", nogil=True)
def advance(
    steps, model, particles, pairs, walls, contacts, contact_count, allowance, scratch, clusters,
    row_of, share,
):  # fmt: skip
    """Advance a thread's share up to `steps` steps; all stop early when the lists are stale or an
    overlap is too large.

    Returns the steps done, DONE | STALE | OVERLAP | WALL_OVERLAP, and the pair or wall contact that
    overlaps too much or -1.
    """
    codes, table, kind_of, dt = model.codes, model.table, model.kind_of, model.dt
    own, limit = share.particles, model.overlap_limit
    found, count = share.found[share.me], len(own.tag)
    for s in range(steps):
        clear_forces(own.force)
        clear_forces(share.kept)
        excess = wall_forces(codes, table, kind_of, dt, particles, walls, share, limit)
        found[WALL] = excess + share.first_contact if excess >= 0 else -1
        found[PAIR] = pair_forces(codes, table, dt, particles, pairs, share, limit)
        meet(share)
        for column, status in ((WALL, WALL_OVERLAP), (PAIR, OVERLAP)):
            if highest(share, column) >= 0:
                return s, status, highest(share, column)
        add_kept(particles.force, share.inbox)
        if model.air[0] > 0.0:
            apply_drag(count, own, model.air[0], model.air[1])
        stale = advance_particles(count, own, model.gravity, dt)
        if len(clusters.mass) > 0:
            meet(share)  # a cluster has members of several threads
        if share.me == 0:
            load_bodies(walls, contacts, contact_count, scratch)
            stale |= advance_clusters(clusters, particles, row_of, model.gravity, dt)
            stale |= move_bodies(walls, model.gravity, dt, allowance)
        found[STALE_LIST] = stale
        meet(share)
        if highest(share, STALE_LIST) > 0:
            return s + 1, STALE, -1
    return steps, DONE, -1
