"""Settled bed in YADE: relax, then three timed blocks.

Arguments: width [m], steps to relax, steps a block, gravity [m/s2].
"""

import csv
import sys
import time

width, gravity = float(sys.argv[-4]), float(sys.argv[-1])
relax, block = int(sys.argv[-3]), int(sys.argv[-2])
salt = O.materials.append(
    FrictMat(young=2.5e7, poisson=0.25, frictionAngle=atan(0.5), density=1210)
)
for row in csv.reader(open("bed.csv")):
    r, x, y, z, u, v, w, a, b, c = (float(q) for q in row)
    i = O.bodies.append(sphere((x, y, z), r, material=salt))
    O.bodies[i].state.vel, O.bodies[i].state.angVel = (u, v, w), (a, b, c)
for place, axis in ((0, 0), (width, 0), (0, 1), (width, 1), (0, 2)):
    O.bodies.append(wall(place, axis=axis, material=salt))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=2e-4),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.544, krot=1e-4, eta=0.23)],
        [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True)],
    ),
    NewtonIntegrator(gravity=(0, 0, -gravity), damping=0.0),
]
O.dt = 7.5e-6
O.run(relax, True)
for _ in range(10):
    begin = time.perf_counter()
    O.run(block, True)
    print("block seconds", time.perf_counter() - begin, flush=True)
