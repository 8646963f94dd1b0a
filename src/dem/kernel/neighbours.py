"""Spatial sorting of particles and the list of pairs that may touch.

Each particle has its own skin: what it may travel before the list is stale. Grains in fast, dilute
flow get a wide one, grains at rest almost none. A particle with reach h = radius + skin falls into
a level of a hierarchy of grids. The cells of a level are twice its largest h. So a size ratio of
ten does not fill the coarse cells with fines. Particles are sorted by level and cell; the cells
x-1, x, x+1 of one row are then one run of memory.
"""

import numpy as np
from numba import njit

from dem.kernel.simd import FIELDS, WIDTH, bits_of, inlined, load_lanes, lowest_bit

LEVELS = 10
LEVEL_RATIO = 1.5
FIRST_LEVEL = LEVEL_RATIO * (1.0 - 1e-9)  # of the smallest reach: up to it a level is 0 for sure
MAX_CELLS_PER_PARTICLE = 16
SINGLE = 2e-7  # of the largest coordinate: bounds what float32 rounds off any
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
def plan_grids(n, particles, attraction):
    """Choose each particle's level and each level's grid.

    Returns reach (n,) [m], level (n,), cell_size (LEVELS,) [m], dims (LEVELS, 3), first_cell
    (LEVELS + 1,), low (3,) [m]. attraction: half the widest gap that a contact bridges [m].
    """
    reach, level, cell_size = np.empty(n), np.zeros(n, np.int32), np.zeros(LEVELS)
    dims, first_cell = np.zeros((LEVELS, 3), np.int64), np.zeros(LEVELS + 1, np.int64)
    low, high, smallest = np.full(3, np.inf), np.full(3, -np.inf), np.inf
    for i in range(n):
        reach[i] = particles.kinetic[i, 6] + np.sqrt(particles.drift[i, 3]) + attraction
        smallest = min(smallest, reach[i])
        for k in range(3):
            low[k] = min(low[k], particles.position[i, k])
            high[k] = max(high[k], particles.position[i, k])
    for i in range(n):
        ratio = reach[i] / smallest
        if ratio > FIRST_LEVEL:  # most grains need no logarithm
            level[i] = min(int(np.log(ratio) / np.log(LEVEL_RATIO)), LEVELS - 1)
        cell_size[level[i]] = max(cell_size[level[i]], 2.0 * reach[i])
    for lv in range(LEVELS):
        cells = 0
        if cell_size[lv] > 0.0:
            while True:
                for k in range(3):
                    dims[lv, k] = int((high[k] - low[k]) / cell_size[lv]) + 1
                exact = float(dims[lv, 0]) * dims[lv, 1] * dims[lv, 2]  # beyond what an int holds
                if exact <= MAX_CELLS_PER_PARTICLE * n + 1024:
                    cells = int(exact)
                    break
                cell_size[lv] *= 1.26  # a few stray particles must not blow up the grid
        first_cell[lv + 1] = first_cell[lv] + cells
    return reach, level, cell_size, dims, first_cell, low


@njit(cache=True, error_model="numpy")
def first_not_finite(n, particles):
    """First row whose position or motion is not a number, or -1."""
    whole = 0.0
    for i in range(n):  # not a number once, not a number for good
        whole += 0.0 * _sum_of(particles.position[i], particles.kinetic[i])
    if whole == 0.0:
        return -1
    for i in range(n):
        if 0.0 * _sum_of(particles.position[i], particles.kinetic[i]) != 0.0:
            return i
    return -1


@inlined
def _sum_of(x, k):
    """Sum of a row's position and motion."""
    return (x[0] + x[1] + x[2]) + ((k[0] + k[1] + k[2] + k[3]) + (k[4] + k[5] + k[6] + k[7]))


@inlined
def cell_of(position, size, dims, low):
    """Cell index of a position (3,) in a grid."""
    x = int((position[0] - low[0]) / size)
    y = int((position[1] - low[1]) / size)
    z = int((position[2] - low[2]) / size)
    return (z * dims[1] + y) * dims[0] + x


@njit(cache=True)
def counting_sort(n, particles, level, cell_size, dims, first_cell, low):
    """Sort by level and cell; returns start (cells + 1,), the first new row of each cell, and order
    (n,), the old row of each new row."""
    start = np.zeros(first_cell[-1] + 1, np.int32)
    cell, order = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        lv = level[i]
        cell[i] = first_cell[lv] + cell_of(particles.position[i], cell_size[lv], dims[lv], low)
        start[cell[i]] += 1
    for c in range(len(start) - 1):
        start[c + 1] += start[c]
    for i in range(n - 1, -1, -1):  # each cell fills from its end
        start[cell[i]] -= 1
        order[start[cell[i]]] = i
    return start, order


@njit(cache=True)
def take_rows(n, old, order, new, new_row):
    """Put the particles of `old` into `new`, all but the forces: new row i is old row order[i].

    Fills new_row (n,): the new row of each old one. Element by element, for a slice of a row costs
    more than its elements."""
    for i in range(n):
        k = order[i]
        new_row[k] = i
        for c in range(4):
            new.position[i, c] = old.position[k, c]
            new.drift[i, c] = old.drift[k, c]
        for c in range(8):
            new.kinetic[i, c] = old.kinetic[k, c]
            new.carry[i, c] = old.carry[k, c]
        new.inverse[i, 0], new.inverse[i, 1] = old.inverse[k, 0], old.inverse[k, 1]
        new.tag[i] = old.tag[k]
        new.material[i] = old.material[k]
        new.cluster[i] = old.cluster[k]


@njit(cache=True, error_model="numpy")
def _searches(cell_size, first_cell, start):
    """(LEVELS, LEVELS) bool: whether the grains of one level look for those of another. Of two
    levels that one does which has fewer rows of cells to look through: a few fast or large grains
    spare all others the search for them."""
    out = np.zeros((LEVELS, LEVELS), np.bool_)
    for fine in range(LEVELS):
        out[fine, fine] = cell_size[fine] > 0.0
        for coarse in range(fine + 1, LEVELS):
            if cell_size[fine] > 0.0 and cell_size[coarse] > 0.0:
                few = start[first_cell[coarse + 1]] - start[first_cell[coarse]]
                many = start[first_cell[fine + 1]] - start[first_cell[fine]]
                across = cell_size[coarse] / cell_size[fine] + 2.0
                upwards = 9.0 * many < across * across * few
                out[fine, coarse], out[coarse, fine] = upwards, not upwards
    return out


@njit(cache=True, error_model="numpy")
def find_pairs(
    n, particles, reach, level, cell_size, dims, first_cell, low, start, kind_of, kinds, pairs
):
    """List all pairs within reach, block by block of one kind; rows must be sorted.

    kind_of (materials, materials): property row of a pair; kinds: the rows that particles can have.
    Of each kind the pairs that touch come first, so that most blocks of the others cost one test a
    step; both are in ascending order of their rows.
    Returns the number of pairs, padding included; when it exceeds the room in `pairs` the list is
    not complete and must be made again with more.
    """
    count, capacity = 0, len(pairs.first)
    searches = _searches(cell_size, first_cell, start)
    sieve, levels = _fill_sieve(n, particles, reach, cell_size, dims, low)
    hits, far = np.empty(n, np.int32), np.empty((capacity, 2), np.int32)
    for kind in kinds:
        before, distant = count, 0
        for i in range(n):
            found = 0
            for lv in range(levels):
                if searches[level[i], lv]:
                    found = _search_level(
                        i, lv == level[i], particles.position, reach, cell_size[lv], dims, lv,
                        first_cell[lv], low, start, sieve, hits, found,
                    )  # fmt: skip
            count, distant = _divide(
                i, found, hits, reach, particles, kind_of, kind, pairs, far, count, distant
            )
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


@njit(cache=True, error_model="numpy")
def _fill_sieve(n, particles, reach, cell_size, dims, low):
    """Sieve (4, n + WIDTH) of places and reaches in float32, the reaches widened by what it may
    round off, and the number of levels."""
    sieve, extent, levels = np.zeros((4, n + WIDTH), np.float32), 0.0, 0
    for lv in range(LEVELS):
        if cell_size[lv] > 0.0:
            levels = lv + 1
            for k in range(3):
                extent = max(extent, dims[lv, k] * cell_size[lv])
    for i in range(n):
        for k in range(3):
            sieve[k, i] = particles.position[i, k] - low[k]
        sieve[3, i] = reach[i] * (1.0 + 1e-6) + SINGLE * extent
    return sieve, levels


@inlined
def _search_level(i, own, position, reach, size, dims, lv, base, low, start, sieve, hits, found):
    """Append to `hits` the rows that may be within reach of row i: of its own level those in the
    cells that follow its own, of another level those in all cells that its reach can meet. Returns
    their number."""
    nx, ny = dims[lv, 0], dims[lv, 1]
    margin = reach[i] + 0.5 * size  # half a cell is the level's widest reach
    px, py, pz = position[i, 0] - low[0], position[i, 1] - low[1], position[i, 2] - low[2]
    x0, x1 = _cells(px, margin, size, nx)
    y0, y1 = _cells(py, margin, size, ny)
    z0, z1 = _cells(pz, margin, size, dims[lv, 2])
    own_y, own_z = int(py / size), int(pz / size)
    xs, ys, zs, reaches = sieve[0], sieve[1], sieve[2], sieve[3]
    x, y, z, h = float(xs[i]), float(ys[i]), float(zs[i]), float(reaches[i])
    for cz in range(own_z if own else z0, z1 + 1):
        for cy in range(own_y if own and cz == own_z else y0, y1 + 1):
            row = base + (cz * ny + cy) * nx
            lo, hi = start[row + x0], start[row + x1 + 1]
            if own and cz == own_z and cy == own_y:
                lo = i + 1
            for j in range(lo, hi, WIDTH):
                dx, dy, dz = load_lanes(xs, j) - x, load_lanes(ys, j) - y, load_lanes(zs, j) - z
                both = load_lanes(reaches, j) + h
                near = bits_of(dx * dx + dy * dy + dz * dz < both * both)
                near &= (1 << min(hi - j, WIDTH)) - 1
                while near:
                    hits[found] = j + lowest_bit(near)
                    found += 1
                    near &= near - 1
    return found


@inlined
def _cells(place, margin, size, cells):
    """First and last cell of a row of them that place +- margin meets."""
    return max(int((place - margin) / size), 0), min(int((place + margin) / size), cells - 1)


@inlined
def _divide(i, found, hits, reach, particles, kind_of, kind, pairs, far, near, distant):
    """Add the pairs of row i with those rows in `hits` that are within reach and of material pair
    `kind`: those that touch or nearly do to `pairs`, the others to `far`; near and distant count
    them."""
    position, cluster, capacity = particles.position, particles.cluster, len(pairs.first)
    x, y, z = position[i, 0], position[i, 1], position[i, 2]
    m, r = particles.material[i], particles.kinetic[i, 6]
    for k in range(found):
        j = hits[k]
        bonded = cluster[i] >= 0 and cluster[i] == cluster[j]  # such do not touch
        if kind_of[m, particles.material[j]] != kind or bonded:
            continue
        dx, dy, dz = position[j, 0] - x, position[j, 1] - y, position[j, 2] - z
        square, h = dx * dx + dy * dy + dz * dz, reach[i] + reach[j]
        touch = NEARLY * (r + particles.kinetic[j, 6])
        within, touches = square < h * h, square < touch * touch
        if near < capacity:  # both are written and one counts: no branch on what is chance
            pairs.first[near], pairs.second[near] = i, j
        if distant < capacity:
            far[distant, 0], far[distant, 1] = i, j
        near += within & touches
        distant += within & (not touches)
    return near, distant


@njit(cache=True)
def carry_history(old, old_count, pairs, count, new_row):
    """Copy each old contact's history to its pair in the new list.

    new_row (n + ghosts,): new row of each old row. Spring and moment act on the first particle, so
    they change sign where the two swap places.
    """
    # chains of old contacts by their lower new row
    head, following = np.full(len(new_row), -1), np.empty(old_count, np.int64)
    for k in range(old_count):
        if old.history[k // WIDTH, 6, k % WIDTH] != 0.0:
            key = min(new_row[old.first[k]], new_row[old.second[k]])
            following[k] = head[key]
            head[key] = k
    pairs.history[: count // WIDTH] = 0.0
    for m in range(count):
        block, lane = m // WIDTH, m % WIDTH
        a, b = pairs.first[m], pairs.second[m]
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
def carry_wall_history(old, old_count, contacts, count, new_row):
    """Copy each old wall contact's history to the same particle and element in the new list."""
    head, following = np.full(len(new_row), -1), np.empty(old_count, np.int64)
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
                for f in range(FIELDS):  # a whole row would compile the words of numpy's refusal
                    contacts.history[m, f] = old.history[k, f]
                break
            k = following[k]
