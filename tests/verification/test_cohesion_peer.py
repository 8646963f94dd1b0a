"""The exported cohesion pulls in LIGGGHTS as it does here: grains that overlap, at rest."""

import math

import pytest
from export_peers import liggghts as run_liggghts

from calibration.engines import liggghts
from calibration.engines.conversion import Conversion, Granulate
from calibration.engines.program import read_dump
from calibration.study.config import overlay
from dem.spec import parse_spec
from small_heap import SPEC

pytestmark = pytest.mark.peer

OVERLAP = 1e-5  # m
GRAINS, WALL = 2e4, 5e4  # J/m3
STICKY = {
    "laws": {"cohesion": "sjkr"},
    "law_parameters": {
        "cohesion_energy_density_J_m3": GRAINS, "wall_cohesion_energy_density_J_m3": WALL
    },
}  # fmt: skip
SCENE = """atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1 units box
create_box 2 box
neighbor 0.001 bin
include material.in
fix move all ${{integrator}}
fix floor all wall/gran ${{law}} primitive type 2 zplane 0.0
create_atoms 1 single 0 0 0.05 units box
create_atoms 1 single {apart:.12g} 0 0.05 units box
create_atoms 1 single 0.05 0 {above:.12g} units box
set group all diameter {diameter:.12g} density 1200
dump forces all custom 1 forces.dump id fx fz
dump_modify forces format "%d %.12g %.12g"
run 0
"""


def test_two_grains_and_a_grain_on_a_wall_attract_as_here(tmp_path):
    spec = parse_spec(overlay(SPEC, STICKY))
    material = Granulate(spec)
    block = liggghts.block(material, Conversion(spec), ["a test"])
    (tmp_path / "material.in").write_text(block)
    r = material.radius
    sizes = {"apart": 2 * r - OVERLAP, "above": r - OVERLAP, "diameter": 2 * r}
    run_liggghts(tmp_path, SCENE.format(**sizes))
    found = read_dump(tmp_path / "forces.dump")

    def force(pair, density):
        hertz = 4 / 3 * pair.young * math.sqrt(pair.radius) * OVERLAP**1.5
        return hertz - density * math.pi * pair.radius * OVERLAP

    assert found["fx"][1] == pytest.approx(force(material.grain_grain, GRAINS), rel=1e-6)
    assert found["fx"][0] == pytest.approx(-found["fx"][1], rel=1e-9)
    assert found["fz"][2] == pytest.approx(force(material.grain_wall, WALL), rel=1e-6)
