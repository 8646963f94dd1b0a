"""The time step, on one screen."""

import numpy as np
from numba import njit

from dem.clusters import advance_clusters
from dem.drag import apply_drag
from dem.forces import clear_forces, pair_forces
from dem.integrate import advance_particles
from dem.walls.contacts import wall_forces
from dem.walls.motion import move_bodies

DONE, STALE, OVERLAP = range(3)


@njit(cache=True, error_model="numpy")
def advance(
    steps,
    n,
    dt,
    gravity,
    codes,
    table,
    wall_kind_of,
    air,
    overlap_limit,
    particles,
    pairs,
    pair_count,
    walls,
    wall_list,
    wall_count,
    allowance,
    geometry,
    feature,
    clusters,
    row_of,
):
    """Advance up to `steps` steps; stop early when the lists are stale or an overlap is too large.

    air (2,): density [kg/m3] and viscosity [Pa s], or zeros. Returns steps done, DONE | STALE | OVERLAP, and the pair
    of largest concern or -1.
    """
    for s in range(steps):
        clear_forces(n, particles.force)
        wall_forces(
            codes,
            table,
            wall_kind_of,
            dt,
            particles,
            walls,
            wall_list,
            wall_count,
            geometry,
            feature,
        )
        excess = pair_forces(codes, table, dt, particles, pairs, pair_count, overlap_limit)
        if excess >= 0:
            return s, OVERLAP, excess
        if air[0] > 0.0:
            apply_drag(n, particles, air[0], air[1])
        stale = advance_particles(n, particles, gravity[0], gravity[1], gravity[2], dt)
        stale |= advance_clusters(clusters, particles, row_of, gravity, dt)
        stale |= move_bodies(walls, gravity, dt, allowance)
        if stale:
            return s + 1, STALE, -1
    return steps, DONE, -1


__all__ = ["DONE", "OVERLAP", "STALE", "advance", "np"]
