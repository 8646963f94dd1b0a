"""YADE (2023.02a) as the engine, with the exported script of materials and walls of facets."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from calibration.engines import EngineError, rig
from calibration.engines.blocks import yade as block
from calibration.engines.program import engine_of, find, read_dump, run, state_of, stated_version

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np

    from dem.spec import RunSpec


INSTALL = "Debian and Ubuntu have it: apt-get install yade"

HEAP = """\
# heap of YADE; SI units. Start: yade -j1 -n -x in.py
import math, random
exec(open("material.py").read())
random.seed({seed})
radii, shares, pitch = {radii}, {shares}, {pitch:.9g}


def band(a, za, b, zb):
    at = lambda r, z, k: Vector3(r * math.cos(k * math.pi / 32), r * math.sin(k * math.pi / 32), z)
    for k in range(64):
        p, q, r, s = at(a, za, k), at(b, zb, k), at(b, zb, k + 1), at(a, za, k + 1)
        for t in ((p, q, r), (p, r, s)):
            if (t[1] - t[0]).cross(t[2] - t[0]).norm() > 1e-12:
                O.bodies.append(facet(t, material="wall"))


band(0, 0, {half_plate:.9g}, 0)
band({half_plate:.9g}, 0, {plate:.9g}, 0)
band({orifice:.9g}, {low:.9g}, {mouth:.9g}, {rim:.9g})
band({mouth:.9g}, {rim:.9g}, {mouth:.9g}, {top:.9g})
reach = math.floor({mouth:.9g} / pitch)
line = [k * pitch for k in range(-reach, reach + 1)]
sites = [(x, y) for x in line for y in line if math.hypot(x, y) < {mouth:.9g} - 0.6 * pitch]
made, owed = 0, 0.0


def grains():
    return [b for b in O.bodies if isinstance(b.shape, Sphere)]


def pour():
    global made, owed
    owed = min(owed + {layer:.9g}, len(sites), {count} - made)
    for x, y in random.sample(sites, int(owed)):
        radius = random.choices(radii, shares)[0]
        shift = [random.uniform(-0.04, 0.04) * pitch for _ in range(3)]
        place = (x + shift[0], y + shift[1], {source:.9g} + shift[2])
        b = O.bodies[O.bodies.append(sphere(place, radius, material="grain"))]
        b.state.vel = (0, 0, -{speed:.9g})
        made, owed = made + 1, owed - 1.0
    for b in [b.id for b in grains() if b.state.pos[2] < {bottom:.9g}]:
        O.bodies.erase(b)


def moving():
    return sum(0.5 * b.state.mass * b.state.vel.squaredNorm() for b in grains())


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist={skin:.9g}),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()], [physics], [law]),
    upkeep,
    NewtonIntegrator(gravity=(0, 0, -{gravity}), damping=0),
    PyRunner(command="pour()", iterPeriod={every}, firstIterRun=1),
]
O.run({first}, True)
for look in range({looks}):
    if moving() < {energy:.9g}:
        break
    O.run({between}, True)
with open("end.dump", "w") as out:
    print("ITEM: ATOMS id radius x y z vx vy vz omegax omegay omegaz", file=out)
    for b in grains():
        print(b.id, b.shape.radius, *b.state.pos, *b.state.vel, *b.state.angVel, file=out)
print("made", made)
"""


@cache
def version() -> str:
    """Version of the installed program. Raises EngineError."""
    return stated_version([find("yade", INSTALL), "--version"], r"version:? *(\S+)").rstrip(",")


def refuse(spec: RunSpec) -> None:
    """Raise EngineError for what YADE cannot represent of a `RunSpec`."""
    rig.refuse(spec, "YADE", block.CODE)


def deck(spec: RunSpec, folder: Path, material: str | None = None) -> None:
    """Write script and material block of a `RunSpec` of a heap into `folder`. material: text of the
    block, that of the spec unless given."""
    (folder / "material.py").write_text(material or rig.block_of(block, spec))
    pour = rig.Pour.of(spec)
    g, pitch, (first, between, looks) = pour.rig, 2.2 * pour.largest, pour.looks
    every = max(round(pitch / pour.speed / pour.dt), 1)  # a layer has left the source by then
    text = HEAP.format(
        seed=spec.seed,
        radii=[float(r) for r in pour.radii],
        shares=[float(s) for s in pour.shares],
        pitch=pitch,
        half_plate=0.5 * g.plate_radius,
        plate=g.plate_radius,
        orifice=g.orifice_radius,
        mouth=g.mouth_radius,
        low=g.orifice_height,
        rim=g.rim_height,
        top=pour.top,
        layer=pour.rate * every * pour.dt,
        count=pour.count,
        source=g.source_height,
        speed=pour.speed,
        bottom=pour.bottom,
        skin=0.1 * min(pour.radii),
        gravity=rig.GRAVITY,
        every=every,
        first=first,
        looks=looks,
        energy=pour.rest_energy,
        between=between,
    )
    (folder / "in.py").write_text(text)


def start(
    spec: RunSpec, folder: Path, timeout_s: float
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Start the program on the script of a `RunSpec` in `folder`; returns metrics and the last
    state. Raises EngineError. The state is as `program.state_of` gives it."""
    output = run([find("yade", INSTALL), "-j1", "-n", "-x", "in.py"], folder, timeout_s)
    made = re.search(r"^made (\d+)$", output, re.MULTILINE)
    if not made:
        raise EngineError(f"yade left no heap: {output.strip()[-300:] or 'no output'}")
    state = state_of(read_dump(folder / "end.dump"))
    return rig.heap_metrics(state, rig.Pour.of(spec), int(made.group(1))), state


ENGINE = engine_of("yade", ("heap",), version, refuse, deck, start)
