"""Contacts of particles with walls: the candidate list and the forces."""

import math

import numpy as np
from numba import njit

from dem.contact.model import wall_contact
from dem.contact.row import properties_of
from dem.kernel.neighbours import LEVELS
from dem.kernel.simd import (
    FIELDS,
    WIDTH,
    column,
    fast_path,
    gather_rows,
    inlined,
    load_block,
    scatter_add,
    store_block,
)
from dem.walls.geometry import (
    PLANE,
    RECTANGLE,
    TRIANGLE,
    closest_point,
    in_space,
    into_body,
    out_of_body,
)
from dem.walls.joints import resolve_joints


@inlined
def _within(walls, e, p, reach):
    b = walls.body[e]
    x, y, z = into_body(walls.origin, walls.rotation, b, p[0], p[1], p[2])
    _, _, _, d = closest_point(walls.kind[e], walls.parameters[e], x, y, z)
    return d < reach


@njit(cache=True, error_model="numpy")
def _bounds(walls, e, low, high):
    """Fill the box (3,), (3,) of an element in space, a plane apart."""
    p, b = walls.parameters[e], walls.body[e]
    corners = np.empty((8, 3))
    for k in range(8):
        s, t, end = (1.0 if k & 1 else -1.0), (1.0 if k & 2 else -1.0), k // 4
        if walls.kind[e] == TRIANGLE:
            for a in range(3):
                corners[k, a] = p[3 * (k % 3) + a]
        elif walls.kind[e] == RECTANGLE:
            for a in range(3):
                corners[k, a] = p[a] + s * p[3 + a] + t * p[6 + a]
        else:
            r = max(p[0], p[2])
            corners[k, 0], corners[k, 1], corners[k, 2] = s * r, t * r, p[1 + 2 * end]
    low[:] = np.inf
    high[:] = -np.inf
    for k in range(8):
        c = in_space(walls, b, corners[k, 0], corners[k, 1], corners[k, 2])
        for a in range(3):
            low[a], high[a] = min(low[a], c[a]), max(high[a], c[a])


@njit(cache=True, error_model="numpy")
def find_wall_contacts(
    n, particles, walls, allowance, reach, cell_size, dims, first_cell, low, start, contacts
):
    """List the candidate contacts, sorted by particle; returns their number (see `find_pairs` for
    too little room). allowance (b,) is what each body may travel [m]."""
    found = np.empty((len(contacts.particle), 2), np.int32)
    count = np.int64(0)  # see `resolve_joints`
    box_low, box_high = np.empty(3), np.empty(3)
    lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
    for e in range(len(walls.kind)):
        extra = allowance[walls.body[e]]
        if walls.kind[e] == PLANE:
            for i in range(n):
                if _within(walls, e, particles.position[i], reach[i] + extra):
                    if count < len(found):
                        found[count, 0], found[count, 1] = i, e
                    count += 1
            continue
        _bounds(walls, e, box_low, box_high)
        for lv in range(LEVELS):
            size = cell_size[lv]
            if size == 0.0:
                continue
            margin = 0.5 * size + extra
            for k in range(3):
                lo[k] = max(math.floor((box_low[k] - margin - low[k]) / size), 0)
                hi[k] = min(math.floor((box_high[k] + margin - low[k]) / size), dims[lv, k] - 1)
            if hi[0] < lo[0]:
                continue
            for cz in range(lo[2], hi[2] + 1):
                for cy in range(lo[1], hi[1] + 1):
                    row = first_cell[lv] + (cz * dims[lv, 1] + cy) * dims[lv, 0]
                    for i in range(start[row + lo[0]], start[row + hi[0] + 1]):
                        if _within(walls, e, particles.position[i], reach[i] + extra):
                            if count < len(found):
                                found[count, 0], found[count, 1] = i, e
                            count += 1
    if count <= len(found):
        _sort_by_particle(n, found, count, contacts)
    return count


@njit(cache=True)
def _sort_by_particle(n, found, count, contacts):
    begin = np.zeros(n + 1, np.int64)
    for k in range(count):
        begin[found[k, 0] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    for k in range(count):
        place = begin[found[k, 0]]
        begin[found[k, 0]] += 1
        contacts.particle[place] = found[k, 0]
        contacts.element[place] = found[k, 1]


@njit(cache=True, error_model="numpy")
def _measure(particles, walls, contacts, count, scratch):
    """Closest point and distance of every candidate.

    One flat loop over plain arrays: named tuples in nested control flow cost numba a reference
    count each.
    """
    position, particle, element = particles.position, contacts.particle, contacts.element
    bodies, kind, parameters = walls.body, walls.kind, walls.parameters
    origin, rotation = walls.origin, walls.rotation
    point, distance, acts, merged = scratch.point, scratch.distance, scratch.acts, scratch.merged
    for k in range(count):
        acts[k] = merged[k] = False
        i, e = np.uint32(particle[k]), np.uint32(element[k])
        x, y, z = into_body(
            origin, rotation, bodies[e], position[i, 0], position[i, 1], position[i, 2]
        )
        point[k, 0], point[k, 1], point[k, 2], distance[k] = closest_point(
            kind[e], parameters[e], x, y, z
        )


@njit(cache=True, error_model="numpy")
def wall_forces(codes, table, kind_of, dt, particles, walls, share, overlap_limit):
    """Add the wall forces of a thread's grains to them and keep them for the bodies
    (`load_bodies`).

    table: properties of pairs; kind_of (materials, materials): rows of it. Contacts that act are
    collected on a stage until WIDTH of one kind are together. Returns a contact whose overlap
    exceeds overlap_limit * radius, or -1.

    Flat loops over plain arrays, as in `_measure`; indices without sign, which numba need not try
    from the end."""
    contacts, scratch, count = share.contacts, share.scratch, len(share.contacts.element)
    _measure(particles, walls, contacts, count, scratch)
    resolve_joints(particles, walls, contacts, count, scratch)
    particle, element, history = contacts.particle, contacts.element, contacts.history
    position, kinetic, material = particles.position, particles.kinetic, particles.material
    force, kind_of_wall, wall_material = particles.force, walls.kind, walls.material
    bodies, parameters, origin = walls.body, walls.parameters, walls.origin
    rotation, velocity, spin = walls.rotation, walls.velocity, walls.spin
    point, distance, acts, push = scratch.point, scratch.distance, scratch.acts, scratch.push
    merged, turn = scratch.merged, scratch.turn
    stage, staged, rows = share.stage, share.staged, share.rows
    k, kind, excess, half = 0, -1, -1, 0.5 * dt
    while k < count:
        waiting = 0
        while k < count:
            i, e, gap = np.uint32(particle[k]), np.uint32(element[k]), distance[k]
            radius = float(kinetic[i, 6])
            if gap >= radius and history[k, 6] == 0.0:
                k += 1
                continue
            row = kind_of[material[i], wall_material[e]]
            if waiting == WIDTH or (row != kind and waiting > 0):
                break
            if radius - gap > overlap_limit * radius:
                excess = k
            b, kind = np.uint32(bodies[e]), row
            # the point, from here on relative to the body's origin, in space
            x, y, z = out_of_body(rotation, b, point[k, 0], point[k, 1], point[k, 2])
            point[k, 0], point[k, 1], point[k, 2] = x, y, z
            if kind_of_wall[e] == PLANE and not merged[k]:
                nx, ny, nz = out_of_body(
                    rotation, b, parameters[e, 3], parameters[e, 4], parameters[e, 5]
                )
            else:
                inverse = 1.0 / max(gap, 1e-30)
                nx = (position[i, 0] - origin[b, 0] - x) * inverse
                ny = (position[i, 1] - origin[b, 1] - y) * inverse
                nz = (position[i, 2] - origin[b, 2] - z) * inverse
            stage[0, 0, waiting] = radius - gap
            stage[0, 1, waiting], stage[0, 2, waiting], stage[0, 3, waiting] = nx, ny, nz
            sx, sy, sz = spin[b, 0], spin[b, 1], spin[b, 2]
            ux, uy, uz = sy * z - sz * y, sz * x - sx * z, sx * y - sy * x
            # across the normal that of the place half a step ago, see `dem.contact.model`
            cx, cy, cz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
            cn = cx * nx + cy * ny + cz * nz
            stage[0, 4, waiting] = velocity[b, 0] + ux - half * (cx - cn * nx)
            stage[0, 5, waiting] = velocity[b, 1] + uy - half * (cy - cn * ny)
            stage[0, 6, waiting] = velocity[b, 2] + uz - half * (cz - cn * nz)
            for f in range(3):
                stage[1, f, waiting] = spin[b, f]
            for f in range(FIELDS):
                stage[2, f, waiting] = history[k, f]
            staged[waiting], rows[waiting] = k, i
            waiting += 1
            k += 1
        if waiting > 0:
            p = properties_of(table, kind)
            staged_forces(codes, p, dt, stage, rows, waiting, kinetic, force)
        for lane in range(waiting):
            m = np.uint32(staged[lane])
            for f in range(FIELDS):
                history[m, f] = stage[4, f, lane]
            acts[m] = True
            for f in range(3):
                push[m, f] = float(stage[3, f, lane])
                turn[m, f] = float(stage[1, f, lane])
    return excess


@njit(cache=True, error_model="numpy")
def load_bodies(walls, contacts, count, scratch):
    """Force and torque of the particles on the bodies: the sums over all contacts in the order of
    the list."""
    walls.force[:] = 0.0
    walls.torque[:] = 0.0
    body, fx, fy, fz, tx, ty, tz = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        if not scratch.acts[k]:
            continue
        b = walls.body[contacts.element[k]]
        if b != body:  # in registers as long as the body stays the same
            _put_load(walls, body, fx, fy, fz, tx, ty, tz)
            body = b
            fx, fy, fz = walls.force[b, 0], walls.force[b, 1], walls.force[b, 2]
            tx, ty, tz = walls.torque[b, 0], walls.torque[b, 1], walls.torque[b, 2]
        q, px, py, pz = scratch.point[k], scratch.push[k, 0], scratch.push[k, 1], scratch.push[k, 2]
        fx, fy, fz = fx - px, fy - py, fz - pz
        tx -= q[1] * pz - q[2] * py + scratch.turn[k, 0]
        ty -= q[2] * px - q[0] * pz + scratch.turn[k, 1]
        tz -= q[0] * py - q[1] * px + scratch.turn[k, 2]
    if len(walls.mass) > 0:
        _put_load(walls, body, fx, fy, fz, tx, ty, tz)


@inlined
def _put_load(walls, b, fx, fy, fz, tx, ty, tz):
    """Store the sums of a body."""
    walls.force[b, 0], walls.force[b, 1], walls.force[b, 2] = fx, fy, fz
    walls.torque[b, 0], walls.torque[b, 1], walls.torque[b, 2] = tx, ty, tz


def staged_forces(codes, p, dt, stage, rows, waiting, kinetic, force):
    """Contact law of the staged contacts: blocks 0-2 of the stage in, force columns (3), history
    (4) and the torque of rolling and torsion (1) out; adds the forces to the particles of these
    rows. Here one contact at a time, in float64."""
    for lane in range(waiting):
        k = kinetic[rows[lane]]
        columns, turning, history = wall_contact(
            codes, p, dt, column(stage[0], lane), column(stage[1], lane),
            (k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]), column(stage[2], lane),
        )  # fmt: skip
        for f in range(3):
            stage[1, f, lane] = turning[f]
        for f in range(8):
            stage[3, f, lane] = columns[f]
            force[rows[lane], f] += columns[f]
        for f in range(FIELDS):
            stage[4, f, lane] = history[f]


@fast_path(staged_forces)
def _staged_forces_lanes(codes, p, dt, stage, rows, waiting, kinetic, force):
    """All lanes at once; those beyond `waiting` hold an earlier contact, of a ghost."""
    for lane in range(waiting, WIDTH):
        rows[lane] = len(kinetic) - 1
    geometry, wall, history = load_block(stage, 0), load_block(stage, 1), load_block(stage, 2)
    columns, turning, history = wall_contact(
        codes, p, dt, geometry, wall, gather_rows(kinetic, rows, 0), history
    )
    store_block(stage, 1, turning)
    store_block(stage, 3, columns)
    store_block(stage, 4, history)
    scatter_add(force, rows, 0, columns)
