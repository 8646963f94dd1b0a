"""The exported blocks pour a heap in LIGGGHTS and in YADE: the calibrated angle, within the spread.

The paper's rig with 1,250 grains of 4 mm. The search for what gives the angle in these codes runs
at that scale first, as the workflow's stage `export_converted` does; the angle is measured by
`dem.measure.heap` on the other engine's last positions and held against this engine's heaps of the
calibrated law.
"""

import json

import numpy as np
import pandas as pd
import pytest
from export_peers import (
    MOUTH,
    PLATE,
    RIM,
    exported,
    liggghts,
    program,
    read_dump,
    reference_spec,
    write_rig,
    yade,
)

from calibration.export import liggghts as to_liggghts
from calibration.export import rolling
from calibration.export import yade as to_yade
from dem.experiments.setup import time_step_of
from dem.measure.heap import measure_heap
from dem.run import run as run_dem
from dem.spec import parse_spec
from stage_files import PlanFiles

# long: its funnel, five grains wide, clogs in some heaps of the search (refused since 0.2.0), so
# that it is not seen to pass with the present engine
pytestmark = [pytest.mark.peer, pytest.mark.slow, pytest.mark.long]

COUNT, DIAMETER, RATE, END = 1250, 4.0, 1250, 2.5
TOPIC = "exported blocks in other engines"
METRIC = "angle_of_repose_deg"


@pytest.fixture(scope="module")
def spec():
    return reference_spec(
        particles={"count": COUNT, "diameter_mm": DIAMETER},
        geometry={"generation_rate_per_s": RATE},
    )


@pytest.fixture(scope="module")
def search(spec, tmp_path_factory):
    """(conversion at this scale as in rolling.json, angles [deg] of this engine's heaps of the
    calibrated law)."""
    for name in ("liggghts", "yade"):
        program(name)
    folder = tmp_path_factory.mktemp("scan")
    rolling.plan_scan(spec, PlanFiles.of(folder))
    scan = pd.read_csv(folder / "design.csv")
    scan["response"] = angles(
        scan["run_id"], json.loads((folder / "plan.json").read_text()), folder
    )
    path, found = rolling.search(scan)
    rows, specs = rolling.rows_at(spec, path, round(found[path].share, 4), 5, "coarse")
    confirmation = pd.DataFrame(rows)
    confirmation["response"] = angles(confirmation["run_id"], specs, folder)
    own = rolling.angles_of(scan, rolling.CALIBRATED)
    return rolling.conclude(parse_spec(spec), scan, confirmation, own, 1.0, "deg"), own


def angles(names, plan, folder):
    return [run_dem(parse_spec(plan[n]), folder / n)["metrics"][METRIC] for n in names]


LIGGGHTS = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region dom block -0.06 0.06 -0.06 0.06 -0.04 {top} units box
create_box 2 dom
neighbor 0.001 bin
neigh_modify delay 0
include {block}
fix move all ${{integrator}}
fix pull all gravity 9.81 vector 0 0 -1
fix funnel all mesh/surface file funnel.stl type 2
fix plate all mesh/surface file plate.stl type 2
fix rig all wall/gran ${{law}} mesh n_meshes 2 meshes funnel plate
fix grain all particletemplate/sphere 15485863 atom_type 1 density constant 1210 &
 radius constant {radius}
fix sizes all particledistribution/discrete/numberbased 15485867 1 grain 1.0
region source cylinder z 0 0 {inner} {low} {high} units box
fix pour all insert/rate/region seed {seed} distributiontemplate sizes nparticles {count} &
 particlerate {rate} &
 insert_every {every} overlapcheck yes vel constant 0 0 -0.3 region source ntry_mc 10000
thermo 10000
thermo_modify lost ignore norm no
run {steps}
dump d all custom 1 final.dump id radius x y z vx vy vz
run 0
"""


def heap_in_liggghts(spec, conversion, folder, seed=86028121):
    """Metrics of a heap poured by LIGGGHTS."""
    write_rig(folder)
    dt = time_step_of(parse_spec(spec))
    radius = 0.5e-3 * DIAMETER
    text = LIGGGHTS.format(
        top=RIM + 0.07,
        block=exported(to_liggghts, spec, conversion, folder),
        radius=radius,
        inner=MOUTH - 1.2 * radius,
        low=RIM + 0.01 - radius,
        high=RIM + 0.01 + 1.3 * radius,
        seed=seed,
        count=COUNT,
        rate=RATE,
        every=round(2.2 * radius / 0.3 / dt),
        steps=round(END / dt),
    )
    liggghts(folder, text)
    d = read_dump(folder / "final.dump")
    position = np.column_stack([d["x"], d["y"], d["z"]])
    velocity = np.column_stack([d["vx"], d["vy"], d["vz"]])
    return measure_heap(position, d["radius"], velocity, PLATE)


YADE = """
import math, random
exec(open("{block}").read())
random.seed({seed})


def band(a, za, b, zb):
    at = lambda r, z, k: Vector3(r * math.cos(k * math.pi / 24), r * math.sin(k * math.pi / 24), z)
    for k in range(48):
        p, q, r, s = at(a, za, k), at(b, zb, k), at(b, zb, k + 1), at(a, za, k + 1)
        for t in ((p, q, r), (p, r, s)):
            if (t[1] - t[0]).cross(t[2] - t[0]).norm() > 1e-12:
                O.bodies.append(facet(t, material="wall"))


band(0, 0, 0.02, 0)
band(0.02, 0, {plate}, 0)
band(0.01, 0.075, {mouth}, {rim})
band({mouth}, {rim}, {mouth}, {rim} + 0.07)
made, pitch = 0, 2.2 * {radius}
line = [(-8 + k) * pitch for k in range(17)]
sites = [(x, y) for x in line for y in line if math.hypot(x, y) < {mouth} - 1.2 * {radius}]


def pour():
    global made
    layer = min(round({rate} * pitch / 0.3), {count} - made)
    for x, y in random.sample(sites, layer):
        shift = [random.uniform(-0.09, 0.09) * {radius} for _ in range(3)]
        place = (x + shift[0], y + shift[1], {rim} + 0.01 + shift[2])
        b = O.bodies[O.bodies.append(sphere(place, {radius}, material="grain"))]
        b.state.vel = (0, 0, -0.3)
        made += 1
    for b in [b.id for b in O.bodies if isinstance(b.shape, Sphere) and b.state.pos[2] < -0.03]:
        O.bodies.erase(b)


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.1 * {radius}),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()], [physics], [law]),
    upkeep,
    NewtonIntegrator(gravity=(0, 0, -9.81), damping=0),
    PyRunner(command="pour()", iterPeriod=round(pitch / 0.3 / O.dt), firstIterRun=1),
]
O.run({steps}, True)
with open("final.csv", "w") as out:
    for b in O.bodies:
        if isinstance(b.shape, Sphere):
            print(b.shape.radius, *b.state.pos, *b.state.vel, file=out)
"""


def heap_in_yade(spec, conversion, folder, seed=1):
    """Metrics of a heap poured by YADE."""
    text = YADE.format(
        block=exported(to_yade, spec, conversion, folder),
        seed=seed,
        plate=PLATE,
        mouth=MOUTH,
        rim=RIM,
        radius=0.5e-3 * DIAMETER,
        rate=RATE,
        count=COUNT,
        steps=round(END / time_step_of(parse_spec(spec))),
    )
    yade(folder, text)
    d = np.loadtxt(folder / "final.csv")
    return measure_heap(d[:, 1:4], d[:, 0], d[:, 4:7], PLATE)


def test_the_search_comes_to_the_calibrated_angle(record, search):
    conversion, _ = search
    assert conversion["reached"]
    found = conversion["coarse"]
    # means of 5 and of 6 heaps
    spread = 3.0 * np.hypot(
        found["sd"] / np.sqrt(found["runs"]),
        found["calibrated_law_sd"] / np.sqrt(found["calibrated_law_runs"]),
    )
    name = f"angle of repose with what the search found ({conversion['path'].replace('_', ' ')})"
    source = "this engine, calibrated law"
    record(TOPIC, name, found["mean"], found["calibrated_law_mean"], spread, "deg", source)


@pytest.mark.parametrize("pour", [heap_in_liggghts, heap_in_yade])
def test_the_heap_has_the_calibrated_angle(record, tmp_path, spec, search, pour):
    conversion, own = search
    angle = pour(spec, conversion, tmp_path)[METRIC]
    # one heap against the mean of n: three standard deviations of their difference
    spread = 3.0 * np.std(own, ddof=1) * np.sqrt(1.0 + 1.0 / len(own))
    name = f"angle of repose with the exported block, {pour.__name__.removeprefix('heap_in_')}"
    source = "this engine, calibrated law"
    record(TOPIC, name, angle, np.mean(own), spread, "deg", source)
