"""A bulk process of Dosta et al. (2024) in YADE."""

import json

with open("case.json") as stream:
    case = json.load(stream)
restitution, friction = case["restitution"], case["friction"]
ids = [
    O.materials.append(FrictMat(young=young, poisson=poisson, density=density, frictionAngle=0.0))
    for young, poisson, density in case["materials"]
]
walls = []
for line in open("walls.txt"):
    q = [float(word) for word in line.split()]
    corners = [Vector3(*q[3 * k : 3 * k + 3]) for k in range(3)]
    walls.append(O.bodies.append(facet(corners, material=ids[-1])))
grains = []
for line in open("grains.txt"):
    q = [float(word) for word in line.split()]
    grains.append(O.bodies.append(sphere(q[2:5], q[1], material=ids[int(q[0])])))
    O.bodies[grains[-1]].state.vel = q[5:8]
pairs = [(a, b) for a in range(len(ids)) for b in range(a, len(ids))]
physics = Ip2_FrictMat_FrictMat_MindlinPhys(
    en=MatchMaker(matches=[(ids[a], ids[b], restitution[a][b]) for a, b in pairs]),
    frictAngle=MatchMaker(matches=[(ids[a], ids[b], atan(friction[a][b])) for a, b in pairs]),
)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=case["skin"]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom(hertzian=True)],
        [physics],
        [Law2_ScGeom_MindlinPhys_Mindlin(preventGranularRatcheting=False)],
    ),
    NewtonIntegrator(damping=0.0, gravity=(0, 0, -case["gravity"])),
]
if case["spin"]:
    O.engines += [
        RotationEngine(
            rotateAroundZero=True,
            zeroPoint=(0, 0, 0),
            rotationAxis=(0, 1, 0),
            angularVelocity=case["spin"],
            ids=walls,
        )
    ]
O.dt = case["dt"]


def _look(out):
    print("ITEM: TIMESTEP", O.iter, "ITEM: NUMBER", len(grains), sep="\n", file=out)
    print("ITEM: ATOMS id x y z", file=out)
    for i in grains:
        print(i - grains[0] + 1, *O.bodies[i].state.pos, file=out)


with open("looks.dump", "w") as out:
    _look(out)
    for _ in range(case["steps"] // case["between"]):
        O.run(case["between"], True)
        _look(out)
