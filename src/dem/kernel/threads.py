"""One run on several threads, the same to the bit whatever their number.

The grains' rows are in spatial order, and each thread has a range of them: their wall contacts, and
the blocks of pairs that begin with one of them. A thread adds a force directly to a grain of its
own, as long as no other thread has one for this grain that comes earlier in the list. All other
forces are kept in rows of their own, which the grain's thread adds afterwards in the order of the
list. Each grain's sum is therefore made in the same order as by one thread.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils

from dem.errors import DemError
from dem.kernel.simd import FIELDS, WIDTH, emits, inlined, place_in
from dem.kernel.state import GHOSTS, Particles, WallContacts, WallScratch, aligned

if TYPE_CHECKING:
    from dem.kernel.state import Pairs


VARIABLE = "DEM_THREADS"
LEAST = 500  # grains of a thread: with fewer it waits for the others more than it works
SPINS = 100_000  # looks at the gate, some 100 us, before a thread sleeps: others may need its core
NAP_US = 1
TOUCHING, IDLE, TOUCHING_WALL = 12, 2, 5  # work of what acts or not, in units of a grain's motion

LINE = 8  # int64 in a cache line

WALL, PAIR, STALE_LIST = range(3)
"""Columns of what a thread has found in a step."""


class Share(NamedTuple):
    """What one thread has to do until the lists are made again. The arrays of `particles`,
    `contacts` and `scratch` are views of the rows that are its own."""

    me: int
    size: int
    """Number of threads."""
    particles: Particles
    """The grains that it moves."""
    contacts: WallContacts
    """Their wall contacts."""
    first_contact: int
    """Where these begin in the list of all."""
    scratch: WallScratch
    stage: np.ndarray
    """(5, FIELDS, WIDTH) real, for its wall contacts: geometry, wall spin, history in; force
    columns, history out, and the torque of rolling and torsion in place of the spin. In cache lines
    of its own, as are the next two."""
    staged: np.ndarray
    """(WIDTH,) int32 candidate in each lane."""
    rows: np.ndarray
    """(WIDTH,) int32 row of its particle."""
    blocks: np.ndarray
    """(b,) uint32 its blocks of pairs, in ascending order."""
    to_first: np.ndarray
    """(m,) int32 row of the forces to which each pair adds that on its first particle."""
    to_second: np.ndarray
    """(m,) int32 the same of the second."""
    kept: np.ndarray
    """(k, 8) real: the forces that it keeps, for grains of others or for later."""
    inbox: np.ndarray
    """(q, 2) int32 rows of the kept forces for its grains, and of these grains, in the list's
    order."""
    found: np.ndarray
    """(size, LINE) int64, shared: what each thread has found in this step, in three columns."""
    gate: np.ndarray
    """(LINE,) int64, shared: how many threads have arrived, and how often all have."""


def threads_chosen(text: str | int | None = None) -> int:
    """Number of threads of a run: that of the environment variable unless given, else 1.

    Raises DemError for what is no positive number."""
    text = os.environ.get(VARIABLE, "1") if text is None else str(text)
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise DemError(f"{VARIABLE} = {text!r:.50}; allowed: a whole number from 1")
    if int(text) > 1 and os.name != "posix":
        raise DemError(f"{VARIABLE} = {text}; allowed on this system: 1")
    return int(text)


def use_threads(number: int | str) -> None:
    """Give every run of this process and its children a number of threads. Raises DemError."""
    os.environ[VARIABLE] = str(threads_chosen(number))


def shares_of(
    threads: int, n: int, particles: Particles, pairs: Pairs, count: int,
    contacts: WallContacts, contact_count: int, scratch: WallScratch,
) -> tuple[list[Share], Particles]:  # fmt: skip
    """The `Share` of each of up to `threads` threads, fewer where there are few grains, of n
    grains, `count` pairs and the wall contacts; and the particles, with room behind them for the
    forces that are kept."""
    size, blocks = max(1, min(threads, n // LEAST)), count // WIDTH
    cuts, holder = np.array([0] + [n] * size), np.zeros(blocks, np.int32)
    to_first, to_second, kept = pairs.first, pairs.second, np.full(size + 1, n + GHOSTS)
    inbox = np.zeros((0, 3), np.int32)
    if size > 1:
        _cut_rows(n, pairs, blocks, contacts, contact_count, cuts)
        owner, waiting = np.zeros(n, np.int32), np.empty((2 * count, 4), np.int32)
        by_lanes = pairs.history.dtype == np.float32
        number = _deal(n, pairs, blocks, cuts, owner, holder, by_lanes, waiting)
        thread, grain, pair, second = waiting[:number].T
        # the kept rows of one thread lie together; `waiting` is in the order of the list
        row = np.empty(number, np.int32)
        row[np.argsort(thread, kind="stable")] = n + GHOSTS + np.arange(number)
        to_first, to_second = pairs.first[:count].copy(), pairs.second[:count].copy()
        to_first[pair[second == 0]] = row[second == 0]
        to_second[pair[second == 1]] = row[second == 1]
        kept[1:] += np.cumsum(np.bincount(thread, minlength=size))
        inbox = np.column_stack([owner[grain], row, grain]).astype(np.int32)
    force = particles.force
    if kept[-1] > len(force):
        room = aligned((int(1.2 * kept[-1]), force.shape[1]), force.dtype)
        particles = particles._replace(force=room)
    edges = np.searchsorted(contacts.particle[:contact_count], cuts)
    # a cache line for each: two threads that write to one wait for each other
    board, lanes = aligned((size + 1, LINE), np.int64), aligned((size, 2, WIDTH), np.int32)
    stages, shares = aligned((size, 5, FIELDS, WIDTH), force.dtype), []
    for k in range(size):
        rows, edge = slice(*cuts[k : k + 2]), slice(*edges[k : k + 2])
        # a view of one row has another type than one of several, and all would be compiled for it
        rows_and_one = slice(rows.start, rows.stop + 1)
        share = Share(
            me=k,
            size=size,
            particles=Particles(*(array[rows] for array in particles))._replace(
                position=particles.position[rows_and_one], kinetic=particles.kinetic[rows_and_one]
            ),
            contacts=WallContacts(*(array[edge] for array in contacts)),
            first_contact=int(edges[k]),
            scratch=WallScratch(*(array[edge] for array in scratch)),
            stage=stages[k],
            staged=lanes[k, 0],
            rows=lanes[k, 1],
            blocks=np.flatnonzero(holder == k).astype(np.uint32),
            to_first=to_first,
            to_second=to_second,
            kept=particles.force[kept[k] : kept[k + 1]],
            inbox=inbox[inbox[:, 0] == k, 1:],
            found=board[:size],
            gate=board[size],
        )
        shares.append(share)
    return shares, particles


@njit(cache=True)
def _cut_rows(n, pairs, blocks, contacts, contact_count, cuts):
    """Fill cuts (threads + 1,) with the first row of each thread, so that each has as much to
    do."""
    work = np.ones(n + GHOSTS, np.int64)
    for block in range(blocks):
        touching = False
        for lane in range(WIDTH):
            touching |= pairs.history[block, 6, lane] != 0.0
        work[pairs.first[block * WIDTH]] += TOUCHING if touching else IDLE
    for k in range(contact_count):
        work[contacts.particle[k]] += 1 + TOUCHING_WALL * (contacts.history[k, 6] != 0.0)
    total, done, share = work[:n].sum(), 0, 1
    for i in range(n):
        if done * (len(cuts) - 1) >= share * total and share < len(cuts) - 1:
            cuts[share] = i
            share += 1
        done += work[i]
    cuts[share:] = n


@njit(cache=True)
def _deal(n, pairs, blocks, cuts, owner, holder, by_lanes, waiting):
    """Deal the blocks of pairs to the threads: fills owner (n,), the thread of each grain, holder
    (blocks,), and the first rows of waiting (2 m, 4): the forces that cannot be added directly, in
    the order of the list: thread, grain, pair, whether it is the pair's second. Returns the number
    of these forces.

    by_lanes: in the fast path a block adds all forces on the first ones before those on the
    second."""
    for k in range(len(cuts) - 1):
        owner[cuts[k] : cuts[k + 1]] = k
    broken, number = np.zeros(n, np.bool_), 0
    for block in range(blocks):
        begin = min(pairs.first[block * WIDTH], n - 1)  # a block may hold ghosts alone
        holder[block] = owner[begin]
        for turn in range(2 * WIDTH):
            if by_lanes:
                k, second = block * WIDTH + turn % WIDTH, turn // WIDTH
            else:
                k, second = block * WIDTH + turn // 2, turn % 2
            grain = pairs.second[k] if second else pairs.first[k]
            if grain >= n or (owner[grain] == holder[block] and not broken[grain]):
                continue
            broken[grain] = True
            waiting[number, 0], waiting[number, 1] = holder[block], grain
            waiting[number, 2], waiting[number, 3] = k, second
            number += 1
    return number


@njit(error_model="numpy")
def clear_forces(force):
    """Zero rows of forces (k, 8)."""
    for i in range(len(force)):
        for f in range(8):
            force[i, f] = 0.0


@njit(error_model="numpy")
def add_kept(force, inbox):
    """Add kept forces to the grains that they are for; inbox (q, 2) rows of both."""
    for k in range(len(inbox)):
        row, grain = inbox[k, 0], inbox[k, 1]
        for f in range(8):
            force[grain, f] += force[row, f]


@inlined
def highest(share, column):
    """Highest of what the threads have found in a column."""
    out = share.found[0, column]
    for k in range(1, share.size):
        out = max(out, share.found[k, column])
    return out


@inlined
def meet(share):
    """Wait until all threads are here. What each wrote before is seen by all afterwards."""
    if share.size == 1:
        return
    gate = share.gate
    often = _atomic_load(gate, 1)
    if _atomic_add(gate, 0) == share.size - 1:
        _atomic_clear(gate, 0)
        _atomic_add(gate, 1)
        return
    looks = 0
    while _atomic_load(gate, 1) == often:
        looks += 1
        if looks > SPINS:
            _nap()


@emits(types.int64)
def _atomic_add(context, builder, kinds, numbers, index):
    """Add one to numbers[index], (m,) int64; returns what was there."""
    place = place_in(context, builder, kinds[0], numbers, index)
    return builder.atomic_rmw("add", place, ir.Constant(ir.IntType(64), 1), "seq_cst")


@emits(types.int64)
def _atomic_load(context, builder, kinds, numbers, index):
    """numbers[index], as the other threads have left it."""
    return builder.load_atomic(place_in(context, builder, kinds[0], numbers, index), "seq_cst", 8)


@emits(types.none)
def _atomic_clear(context, builder, kinds, numbers, index):
    """Set numbers[index] to zero."""
    place = place_in(context, builder, kinds[0], numbers, index)
    builder.store_atomic(ir.Constant(ir.IntType(64), 0), place, "seq_cst", 8)


@emits(types.none)
def _nap(context, builder, kinds):
    """Sleep for as short a time as the system can."""
    if os.name == "posix":  # elsewhere there is one thread, and no such function
        kind = ir.FunctionType(ir.IntType(32), [ir.IntType(32)])
        sleep = cgutils.get_or_insert_function(builder.module, kind, "usleep")
        builder.call(sleep, [ir.Constant(ir.IntType(32), NAP_US)])
