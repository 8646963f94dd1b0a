"""Forces of the pairs: the float64 reference path and the fast path on lanes, both around
`pair_contact`."""

import numpy as np

from dem.contact.model import pair_contact, pair_is_active, pair_overlap
from dem.contact.row import properties_of
from dem.kernel.arithmetic import any_lane, minimum
from dem.kernel.simd import (
    FIELDS,
    WIDTH,
    column,
    fast_path,
    gather_pairs,
    gather_separations,
    load_block,
    load_field,
    scatter_add,
    store_block,
)

NEARLY = 1.0 + 1e-9
"""Of the squared sum of the radii: closer spheres get the exact test, whatever this one rounds."""


def pair_forces(codes, table, dt, particles, pairs, share, overlap_limit):
    """Add the forces of a thread's pairs to the particles and update the contacts' history; here
    one pair at a time, in float64 throughout.

    Returns a pair (its block's first in the fast path) whose overlap exceeds overlap_limit *
    radius, or -1.
    """
    excess = -1
    for m in range(len(share.blocks) * WIDTH):
        block, lane = np.int64(share.blocks[m // WIDTH]), m % WIDTH
        k = block * WIDTH + lane
        i, j = pairs.first[k], pairs.second[k]
        x, a, b = particles.position, particles.kinetic[i], particles.kinetic[j]
        h = pairs.history[block]
        separation = (x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2])
        p = properties_of(table, pairs.kind[block])
        overlap, inverse = pair_overlap(separation, a[6], b[6])
        if not pair_is_active(codes, p, overlap, a[6], b[6], h[6, lane]):
            continue
        first = (a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7])
        second = (b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7])
        on_first, on_second, history = pair_contact(
            codes, p, dt, separation, inverse, overlap, first, second, column(h, lane)
        )
        for f in range(FIELDS):
            h[f, lane] = history[f]
        for f in range(8):
            particles.force[share.to_first[k], f] += on_first[f]
            particles.force[share.to_second[k], f] += on_second[f]
        if overlap > overlap_limit * min(a[6], b[6]):
            excess = k
    return excess


@fast_path(pair_forces)
def _pair_forces_lanes(codes, table, dt, particles, pairs, share, overlap_limit):
    """WIDTH pairs at a time, float32 but for the separations."""
    excess, blocks, to_first, to_second = -1, share.blocks, share.to_first, share.to_second
    for m in range(len(blocks)):
        block = np.int64(blocks[m])
        start = block * WIDTH
        before = load_field(pairs.history, block, 6)
        if not any_lane((before > 0.0) | (before < 0.0)):
            x, y, z, reach = gather_separations(
                particles.position, pairs.first, pairs.second, start
            )
            if not any_lane(x * x + y * y + z * z < NEARLY * (reach * reach)):
                continue
        g = gather_pairs(particles.position, pairs.first, pairs.second, start)
        separation, first, second = g[:3], g[3:11], g[11:]
        r_i, r_j = first[6], second[6]
        history = load_block(pairs.history, block)
        p = properties_of(table, pairs.kind[block])
        overlap, inverse = pair_overlap(separation, r_i, r_j)
        if not any_lane(pair_is_active(codes, p, overlap, r_i, r_j, history[6])):
            continue
        on_first, on_second, history = pair_contact(
            codes, p, dt, separation, inverse, overlap, first, second, history
        )
        store_block(pairs.history, block, history)
        scatter_add(particles.force, to_first, start, on_first)
        scatter_add(particles.force, to_second, start, on_second)
        if any_lane(overlap > overlap_limit * minimum(r_i, r_j)):
            excess = start
    return excess
