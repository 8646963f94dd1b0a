"""The exported blocks in the engines they are meant for: one grain and two grains against closed
forms.

An impact of two grains gives the coefficient of restitution. If they spin against each other they
do not slide where they touch, and the rolling torque alone slows them, by mu_r R* J / I for a
normal impulse J. A grain that rolls on a plane loses speed at (5/7) mu_r g.
"""

import numpy as np
import pytest
from export_peers import exported, lammps, liggghts, reference_spec, yade

import other_codes
from calibration.engines import lammps as to_lammps
from calibration.engines import liggghts as to_liggghts
from calibration.engines import yade as to_yade
from calibration.engines.program import read_dump
from calibration.study.config import overlay
from dem.spec import parse_spec

pytestmark = pytest.mark.peer

R, SPEED, SPIN = 1e-3, 0.5, 2000.0
MU_R, MU_WALL, U0, TIME = 0.8, 0.1, 0.3, 0.05
STEP = 1e-6
TOPIC = "exported blocks in other engines"
FOUND = other_codes.FOUND | {"rolling_friction": MU_R}


@pytest.fixture
def spec():
    return reference_spec(contacts={"particle_wall": {"rolling_friction": MU_WALL}})


HEAD = """
{atom_style}
boundary f f f
newton off
{velocities}
units si
read_data grains.data
neighbor 0.0005 bin
neigh_modify delay 0
include {block}
timestep {step}
fix move all ${{integrator}}
"""
DUMP = """
dump d all custom 1 final.dump id x y z vx vy vz omegax omegay omegaz
run 0
"""
PLANE = """
fix pull all gravity 9.81 vector 0 0 -1
fix floor all wall/gran {floor}
"""
FLOOR = {
    liggghts: "${law} primitive type 2 zplane 0.0",
    lammps: "granular ${grain_wall} zplane 0.0 NULL",
}
CODES = {liggghts: to_liggghts, lammps: to_lammps}


def lammps_like(engine, spec, folder, grains, scene, steps):
    """Run grains (position, velocity, spin) in LIGGGHTS or LAMMPS with its exported block; returns
    the last dump."""
    mine = engine is liggghts
    rows = [f"{k + 1} 1 {2 * R} 1210 {' '.join(map(str, g[0]))}" for k, g in enumerate(grains)]
    moving = [f"{k + 1} {' '.join(map(str, g[1] + g[2]))}" for k, g in enumerate(grains)]
    (folder / "grains.data").write_text(
        f"grains\n\n{len(rows)} atoms\n2 atom types\n\n"
        "-0.05 0.05 xlo xhi\n-0.05 0.05 ylo yhi\n-0.01 0.05 zlo zhi\n\n"
        + ("Atoms\n\n" if mine else "Atoms # sphere\n\n")
        + "\n".join(rows)
        + "\n\nVelocities\n\n"
        + "\n".join(moving)
        + "\n"
    )
    head = HEAD.format(
        atom_style="atom_style granular\natom_modify map array" if mine else "atom_style sphere",
        velocities="communicate single vel yes" if mine else "comm_modify vel yes",
        block=exported(CODES[engine], spec, FOUND, folder),
        step=STEP,
    )
    engine(folder, head + scene + f"run {steps}\n" + DUMP)
    return read_dump(folder / "final.dump")


def pair_result(engine, spec, folder):
    """(rebound speed over impact speed, loss of spin [rad/s]) of two grains that spin against each
    other."""
    if engine is yade:
        return yade_pair(spec, folder)
    grains = [
        ((0.0, 0.0, 0.02), (SPEED / 2, 0.0, 0.0), (0.0, 0.0, SPIN)),
        ((2.001 * R, 0.0, 0.02), (-SPEED / 2, 0.0, 0.0), (0.0, 0.0, -SPIN)),
    ]
    end = lammps_like(engine, spec, folder, grains, "", 1500)
    return (end["vx"][1] - end["vx"][0]) / SPEED, SPIN - np.abs(end["omegaz"]).mean()


def plane_result(engine, spec, folder):
    """Speed [m/s] of a grain that has rolled on a plane for TIME."""
    if engine is yade:
        return yade_plane(spec, folder)
    grains = [((-0.04, 0.0, 0.9999 * R), (U0, 0.0, 0.0), (0.0, U0 / R, 0.0))]
    scene = PLANE.format(floor=FLOOR[engine])
    return lammps_like(engine, spec, folder, grains, scene, round(TIME / STEP))["vx"][0]


YADE_ENGINES = """
exec(open("{block}").read())
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()]),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()], [physics], [law]),
    upkeep,
    NewtonIntegrator(gravity=(0, 0, {gravity}), damping=0),
]
O.dt = {step}
"""


def yade_pair(spec, folder):
    block = exported(to_yade, spec, FOUND, folder)
    text = (
        YADE_ENGINES.format(block=block, gravity=0, step=STEP)
        + f"""
for x, side in ((0, 1), ({2.001 * R}, -1)):
    b = O.bodies[O.bodies.append(sphere((x, 0, 0), {R}, material="grain"))]
    b.state.vel, b.state.angVel = (side * {SPEED / 2}, 0, 0), (0, 0, side * {SPIN})
O.run(1500, True)
a, b = (O.bodies[k].state for k in (0, 1))
print("RESULT", (b.vel[0] - a.vel[0]) / {SPEED}, {SPIN} - (a.angVel[2] - b.angVel[2]) / 2)
"""
    )
    return result_of(yade(folder, text))


def yade_plane(spec, folder):
    block = exported(to_yade, spec, FOUND, folder)
    text = (
        YADE_ENGINES.format(block=block, gravity=-9.81, step=STEP)
        + f"""
O.bodies.append(facet([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], material="wall"))
b = O.bodies[O.bodies.append(sphere((0, 0, {0.9999 * R}), {R}, material="grain"))]
b.state.vel, b.state.angVel = ({U0}, 0, 0), (0, {U0 / R}, 0)
O.run({round(TIME / STEP)}, True)
print("RESULT", b.state.vel[0])
"""
    )
    return result_of(yade(folder, text))[0]


def result_of(output):
    line = next(x for x in output.splitlines() if x.startswith("RESULT"))
    return [float(x) for x in line.split()[1:]]


@pytest.mark.parametrize("engine", [liggghts, lammps, yade])
def test_two_grains_part_with_the_restitution(record, tmp_path, engine, spec):
    e = parse_spec(spec).contacts.particle_particle.restitution
    rebound, _ = pair_result(engine, spec, tmp_path)
    record(TOPIC, f"restitution of two grains, {engine.__name__}", rebound, e, 0.01)


@pytest.mark.parametrize("engine", [liggghts, lammps, yade])
def test_two_grains_slow_each_other_with_the_rolling_torque(record, tmp_path, engine, spec):
    """Elastic: where a dashpot attracts at the end, LIGGGHTS takes the force's size and YADE drops
    the limit."""
    elastic = overlay(spec, {"contacts": {"particle_particle": {"restitution": 1.0}}})
    _, loss = pair_result(engine, elastic, tmp_path)
    # J = m v, R* = R / 2, I = 0.4 m R^2
    expected = MU_R * (R / 2) * SPEED / (0.4 * R**2)
    name = f"loss of spin of two grains, {engine.__name__}"
    record(TOPIC, name, loss, expected, 0.02 * expected, "rad/s")


@pytest.mark.parametrize("engine", [liggghts, lammps, yade])
def test_a_grain_rolling_on_a_wall_slows_as_it_should(record, tmp_path, engine, spec):
    speed = plane_result(engine, spec, tmp_path)
    expected = U0 - 5 / 7 * MU_WALL * 9.81 * TIME
    record(
        TOPIC,
        f"speed of a rolling grain, {engine.__name__}",
        speed,
        expected,
        0.02 * (U0 - expected) + 2e-3 * U0,
        "m/s",
    )
