"""This engine's beds and heaps with the springs and the relative torque as LIGGGHTS codes them, to
tell conventions from faults.

`python -m liggghts.as_coded OUT` writes the metrics of both as JSON. The laws are exchanged before
anything is compiled; NUMBA_CACHE_DIR must name a folder of its own, or the engine's cache would
hold the other laws.
"""

import os
import sys

import dem.contact.rolling.constant_torque_relative as relative
import dem.contact.rolling.elastic_plastic as elastic_plastic
import dem.contact.tangential.mindlin as mindlin
from dem.io.files import write_json
from dem.kernel.arithmetic import dot, law, maximum, minimum, reject, scale, sqrt, subtract, where

from . import cases


@law
def torque(p, n, spin, normal, stiffness, unloading, r_eff, inertia, spring, dt):
    """Torque on the first sphere (3,) [N m]: over the whole relative spin, and not limited to what
    stops it."""
    whole = sqrt(dot(spin, spin)) + relative.TINY
    return scale(-p.rolling * normal * r_eff / whole, reject(spin, n)), spring


scaled = elastic_plastic.torque


@law
def kept_moment(p, n, spin, normal, stiffness, unloading, r_eff, inertia, spring, dt):
    """The elastic-plastic torque and moment (3,) [N m], the moment kept while the contact unloads,
    so that the work stored in it grows as the stiffness falls."""
    return scaled(p, n, spin, normal, stiffness, 1.0, r_eff, inertia, spring, dt)


@law
def tangential_force(p, n, v_t, stiffness, contact_radius, radius_before, m_eff, spring, limit, dt):
    """Tangential force and spring force (3,) [N] of a stretched length: the force follows the
    stiffness also while the contact loads. Friction limits the spring alone, and the dashpot acts
    where it holds."""
    along = 8.0 * p.shear * contact_radius
    grown = contact_radius / maximum(radius_before, mindlin.TINY)
    spring = subtract(scale(grown, reject(spring, n)), scale(along * dt, v_t))
    size = sqrt(dot(spring, spring)) + mindlin.TINY
    spring = scale(minimum(limit / size, 1.0), spring)
    dashpot = where(size < limit, p.damping * sqrt(along * m_eff), 0.0 * limit)
    return subtract(spring, scale(dashpot, v_t)), spring


def beds():
    """Metrics of the settled beds of all seeds."""
    for seed in cases.SEEDS:
        sim, width = cases.bed(seed, **cases.BED)
        sim.advance(cases.BED["steps"])
        yield cases.measure_bed(cases.state_of_sim(sim), width)


def heaps(case):
    """Metrics of the heaps of a case of all seeds."""
    for seed in cases.HEAP_SEEDS[case]:
        spec = cases.heap_spec(*cases.HEAPS[case], seed)
        yield cases.measure_pile(cases.our_heap(spec), spec)


if __name__ == "__main__":
    if not os.environ.get("NUMBA_CACHE_DIR"):
        sys.exit("set NUMBA_CACHE_DIR to a folder of its own")
    relative.torque, mindlin.tangential_force = torque, tangential_force
    elastic_plastic.torque = kept_moment
    piles = {case: list(heaps(case)) for case in cases.HEAPS}
    write_json(sys.argv[1], {"beds": list(beds()), "heaps": piles})
