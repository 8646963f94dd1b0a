"""Spatial sorting of particles and the list of pairs that may touch.

Each particle has its own skin: what it may travel before the list is stale. Grains in fast, dilute
flow get a wide one, grains at rest almost none. A particle with reach h = radius + skin falls into
a level of a hierarchy of grids whose cells are twice the largest h of the level, so that a size
ratio of ten does not fill the coarse cells with fines. Particles are sorted by level and cell; the
cells x-1, x, x+1 of one row are then one run of memory.
"""

import numpy as np
from numba import njit

from dem.lanes import FIELDS, WIDTH, inlined

LEVELS = 10
LEVEL_RATIO = 1.5
MAX_CELLS_PER_PARTICLE = 16
NEARLY = 1.0005  # of the sum of the radii: pairs that count as touching when the list is sorted


@njit(cache=True, error_model="numpy")
def assign_skins(n, particles, base, horizon, gravity):
    """Set each particle's skin [m] to base * radius plus its travel over `horizon` [s], and reset
    the drift."""
    for i in range(n):
        k = particles.kinetic[i]
        speed = np.sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2])
        skin = base * k[6] + horizon * (speed + 0.5 * gravity * horizon)
        # a skin wider than a few radii would only fill the list
        skin = min(skin, 2.0 * k[6] + base * k[6])
        particles.drift[i, :3] = 0.0
        particles.drift[i, 3] = skin * skin


@njit(cache=True, error_model="numpy")
def plan_grids(n, particles, reach, level, cell_size, dims, first_cell, low, attraction):
    """Choose each particle's level and each level's grid.

    Fills reach (n,) [m], level (n,), cell_size (LEVELS,) [m], dims (LEVELS, 3), first_cell (LEVELS
    + 1,), low (3,) [m]. attraction: half the widest gap that a contact bridges [m].
    """
    low[:] = np.inf
    high = np.full(3, -np.inf)
    smallest = np.inf
    for i in range(n):
        reach[i] = particles.kinetic[i, 6] + np.sqrt(particles.drift[i, 3]) + attraction
        smallest = min(smallest, reach[i])
        for k in range(3):
            low[k] = min(low[k], particles.position[i, k])
            high[k] = max(high[k], particles.position[i, k])
    cell_size[:] = 0.0
    for i in range(n):
        level[i] = min(int(np.log(reach[i] / smallest) / np.log(LEVEL_RATIO)), LEVELS - 1)
        cell_size[level[i]] = max(cell_size[level[i]], 2.0 * reach[i])
    first_cell[0] = 0
    for lv in range(LEVELS):
        dims[lv] = 0
        cells = 0
        if cell_size[lv] > 0.0:
            while True:
                for k in range(3):
                    dims[lv, k] = int((high[k] - low[k]) / cell_size[lv]) + 1
                cells = dims[lv, 0] * dims[lv, 1] * dims[lv, 2]
                if cells <= MAX_CELLS_PER_PARTICLE * n + 1024:
                    break
                cell_size[lv] *= 1.26  # a few stray particles must not blow up the grid
        first_cell[lv + 1] = first_cell[lv] + cells


@inlined
def cell_of(position, size, dims, low):
    """Cell index of a position (3,) in a grid."""
    x = int((position[0] - low[0]) / size)
    y = int((position[1] - low[1]) / size)
    z = int((position[2] - low[2]) / size)
    return (z * dims[1] + y) * dims[0] + x


@njit(cache=True)
def counting_sort(n, particles, level, cell_size, dims, first_cell, low, cell, start, order):
    """Sort by level and cell: order (n,) old row of each new row; start (cells + 1,) first new row
    of each cell."""
    start[:] = 0
    for i in range(n):
        lv = level[i]
        cell[i] = first_cell[lv] + cell_of(particles.position[i], cell_size[lv], dims[lv], low)
        start[cell[i] + 1] += 1
    for c in range(len(start) - 1):
        start[c + 1] += start[c]
    for i in range(n):
        order[start[cell[i]]] = i
        start[cell[i]] += 1
    for c in range(len(start) - 1, 0, -1):
        start[c] = start[c - 1]
    start[0] = 0


@njit(cache=True)
def take_rows(n, array, order, out):
    """out[:n] = array[order]; element by element, for a slice of a row costs more than its
    elements."""
    for i in range(n):
        for c in range(array.shape[1]):
            out[i, c] = array[order[i], c]


@njit(cache=True)
def take_values(n, array, order, out):
    """out[:n] = array[order] for one-dimensional arrays."""
    for i in range(n):
        out[i] = array[order[i]]


@inlined
def _scan(i, lo, hi, particles, reach, kind_of, kind, pairs, far, near, distant):
    """Add pairs of row i with rows lo..hi-1 that are within reach and of material pair `kind`.

    Pairs that touch or nearly do go to `pairs`, the others to `far`; near and distant count them.
    """
    position, first, second = particles.position, pairs.first, pairs.second
    x, y, z = position[i, 0], position[i, 1], position[i, 2]
    m, r = particles.material[i], particles.kinetic[i, 6]
    capacity = len(first)
    for j in range(lo, hi):
        dx, dy, dz = position[j, 0] - x, position[j, 1] - y, position[j, 2] - z
        h = reach[i] + reach[j]
        squared = dx * dx + dy * dy + dz * dz
        if squared < h * h and kind_of[m, particles.material[j]] == kind:
            if same_cluster(particles.cluster, i, j):
                continue
            touch = NEARLY * (r + particles.kinetic[j, 6])
            if squared < touch * touch:
                if near < capacity:
                    first[near], second[near] = i, j
                near += 1
            else:
                if distant < capacity:
                    far[distant, 0], far[distant, 1] = i, j
                distant += 1
    return near, distant


@inlined
def same_cluster(cluster, i, j):
    """Members of one rigid cluster do not touch each other."""
    return cluster[i] >= 0 and cluster[i] == cluster[j]


@njit(cache=True, error_model="numpy")
def find_pairs(
    n, particles, reach, level, cell_size, dims, first_cell, low, start, kind_of, kinds, pairs, far
):
    """List all pairs within reach, block by block of one kind; rows must be sorted.

    kind_of (materials, materials): property row of a pair; kinds: the rows that particles can have;
    far (capacity, 2) int32: scratch. Of each kind the pairs that touch come first, so that most
    blocks of the others cost one test a step.
    Returns the number of pairs, padding included; when it exceeds the room in `pairs` the list is
    not complete and must be made again with more.
    """
    count, capacity = 0, len(pairs.first)
    for kind in kinds:
        before, distant = count, 0
        for i in range(n):
            for lv in range(level[i], LEVELS):
                if cell_size[lv] > 0.0:
                    count, distant = _search_level(
                        i, lv, lv == level[i], particles, reach, cell_size[lv], dims[lv],
                        first_cell[lv], low, start, kind_of, kind, pairs, far, count, distant,
                    )  # fmt: skip
        if count + distant + WIDTH > capacity:
            count += distant + WIDTH
            continue
        for k in range(distant):
            pairs.first[count], pairs.second[count] = far[k, 0], far[k, 1]
            count += 1
        while count % WIDTH:
            pairs.first[count], pairs.second[count] = n, n + 1
            count += 1
        for block in range(before // WIDTH, count // WIDTH):
            pairs.kind[block] = kind
    return count


@inlined
def _search_level(
    i, lv, own, particles, reach, size, dims, base, low, start, kind_of, kind, pairs, far, near,
    distant
):  # fmt: skip
    """Pairs of row i with one level: half of the stencil on its own level, all of it on a coarser
    one."""
    p = particles.position[i]
    x, y, z = int((p[0] - low[0]) / size), int((p[1] - low[1]) / size), int((p[2] - low[2]) / size)
    x0, x1 = max(x - 1, 0), min(x + 1, dims[0] - 1)
    for dz in range(0 if own else -1, 2):
        if z + dz < 0 or z + dz >= dims[2]:
            continue
        for dy in range(0 if own and dz == 0 else -1, 2):
            if y + dy < 0 or y + dy >= dims[1]:
                continue
            row = base + ((z + dz) * dims[1] + y + dy) * dims[0]
            lo, hi = start[row + x0], start[row + x1 + 1]
            if own and dz == 0 and dy == 0:
                lo = i + 1
            near, distant = _scan(
                i, lo, hi, particles, reach, kind_of, kind, pairs, far, near, distant
            )
    return near, distant


@njit(cache=True)
def carry_history(old, old_count, pairs, count, new_row, head, following):
    """Copy each old contact's history to its pair in the new list.

    new_row (n + ghosts,): new row of each old row; head (n + ghosts,), following (old_count,):
    scratch for chains of old contacts by their lower new row. Spring and moment act on the first
    particle, so they change sign where the two swap places.
    """
    head[:] = -1
    for k in range(old_count):
        if old.history[k // WIDTH, 6, k % WIDTH] != 0.0:
            key = min(new_row[old.first[k]], new_row[old.second[k]])
            following[k] = head[key]
            head[key] = k
    for m in range(count):
        block, lane = m // WIDTH, m % WIDTH
        a, b = pairs.first[m], pairs.second[m]
        for f in range(FIELDS):
            pairs.history[block, f, lane] = 0.0
        k = head[min(a, b)]
        while k >= 0:
            i, j = new_row[old.first[k]], new_row[old.second[k]]
            if max(i, j) == max(a, b):
                sign = 1.0 if i == a else -1.0
                for f in range(FIELDS):
                    value = old.history[k // WIDTH, f, k % WIDTH]
                    pairs.history[block, f, lane] = sign * value if f < 6 else value
                break
            k = following[k]


@njit(cache=True)
def carry_wall_history(old, old_count, contacts, count, new_row, head, following):
    """Copy each old wall contact's history to the same particle and element in the new list."""
    head[:] = -1
    for k in range(old_count):
        if old.history[k, 6] != 0.0:
            key = new_row[old.particle[k]]
            following[k] = head[key]
            head[key] = k
    for m in range(count):
        contacts.history[m] = 0.0
        k = head[contacts.particle[m]]
        while k >= 0:
            if old.element[k] == contacts.element[m]:
                contacts.history[m] = old.history[k]
                break
            k = following[k]
