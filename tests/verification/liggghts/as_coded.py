"""This engine's heaps with the relative torque as LIGGGHTS codes its `cdt`, to tell conventions from faults.

`python -m liggghts.as_coded OUT ROLLING SEED...` writes the metrics of the heaps as JSON. The law is exchanged before
anything is compiled; NUMBA_CACHE_DIR must name a folder of its own, or the engine's cache would hold the other law.
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


def main(out, rolling, seeds):
    relative.torque = torque
    rows = []
    for seed in seeds:
        spec = cases.heap_spec("constant_torque_relative", rolling, seed)
        rows.append(cases.measure_pile(cases.our_heap(spec), spec))
    write_json(out, rows)


if __name__ == "__main__":
    if not os.environ.get("NUMBA_CACHE_DIR"):
        sys.exit("set NUMBA_CACHE_DIR to a folder of its own")
    main(sys.argv[1], float(sys.argv[2]), [int(s) for s in sys.argv[3:]])
