"""This engine's beds and heaps with the relative torque as LIGGGHTS codes its `cdt`, to tell conventions from faults.

`python -m liggghts.as_coded OUT` writes the metrics of both as JSON. The law is exchanged before anything is compiled;
NUMBA_CACHE_DIR must name a folder of its own, or the engine's cache would hold the other law.
"""

import os
import sys

import dem.contact.rolling.constant_torque_relative as relative
from dem.io.files import write_json
from dem.lanes import law, sqrt
from dem.vectors import dot, reject, scale

from . import cases


@law
def torque(p, n, spin, normal, r_eff, inertia, dt):
    """Torque on the first sphere (3,) [N m]: over the whole relative spin, and not limited to what stops it."""
    whole = sqrt(dot(spin, spin)) + relative.TINY
    return scale(-p.rolling * normal * r_eff / whole, reject(spin, n))


def beds():
    """Metrics of the settled beds of all seeds."""
    for seed in cases.SEEDS:
        sim, width = cases.bed(seed, **cases.BED)
        sim.advance(cases.BED["steps"])
        yield cases.measure_bed(cases.state_of_sim(sim), width)


def heaps():
    """Metrics of the heaps of all seeds."""
    for seed in cases.SEEDS:
        spec = cases.heap_spec(*cases.HEAPS["relative, 0.46"], seed)
        yield cases.measure_pile(cases.our_heap(spec), spec)


if __name__ == "__main__":
    if not os.environ.get("NUMBA_CACHE_DIR"):
        sys.exit("set NUMBA_CACHE_DIR to a folder of its own")
    relative.torque = torque
    write_json(sys.argv[1], {"beds": list(beds()), "heaps": list(heaps())})
