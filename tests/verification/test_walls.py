"""Each analytic wall against its meshed twin read from STL, and against the closed form of a
plane."""

import numpy as np
import pytest

from dem.io.stl import read_stl, write_stl
from dem.walls.builder import WallSet
from scenes import GRAVITY, ContactParameters, Laws, make, revolved

FINE = 256
TIME_STEP = 5e-6


def rectangle_mesh(a, b):
    return np.array([(-a, -b, 0), (a, -b, 0), (a, b, 0), (-a, b, 0)], float), np.array(
        [(0, 1, 2), (0, 2, 3)]
    )


SHAPES = {
    "disc": (
        lambda w: w.disc(0.01),
        revolved([(0, 0), (0.005, 0), (0.01, 0)], FINE),
        (0.001, 0.002, 0.004),
        (0.06, 0.03, 0),
    ),
    "frustum": (
        lambda w: w.frustum(0.004, 0, 0.012, 0.014),
        revolved(np.linspace((0.004, 0), (0.012, 0.014), 5), FINE),
        (0.006, 0.001, 0.012),
        (0, 0.15, 0),
    ),
    "cylinder": (
        lambda w: w.cylinder(0.006, -0.02, 0.02),
        revolved(np.linspace((0.006, -0.02), (0.006, 0.02), 9), FINE),
        (0.002, 0.001, 0.01),
        (0.15, 0.1, 0),
    ),
    "rectangle": (
        lambda w: w.rectangle((0, 0, 0), (0.01, 0, 0), (0, 0.01, 0)),
        rectangle_mesh(0.01, 0.01),
        (-0.004, 0.001, 0.003),
        (0.2, 0.1, 0),
    ),
}


def path(walls, start, velocity, steps=12000, rolling="constant_torque"):
    """Centres of a grain at 20 equal intervals; 60 ms is long enough for every grain here to fall
    onto its wall."""
    sim = make(
        ContactParameters(0.6, 0.4, 0.05),
        laws=Laws(rolling=rolling),
        walls=walls,
        dt=TIME_STEP,
        gravity=GRAVITY,
    )
    sim.add_particles([start], 1e-3, velocity=[velocity])
    out = []
    for _ in range(20):
        sim.advance(steps // 20)
        out.append(sim.position[0])
    return np.array(out)


def departure_from_free_flight(path, start, velocity, duration):
    """Largest distance [m] between a path and the parabola that a grain without walls would
    take."""
    t = np.linspace(0, duration, len(path) + 1)[1:, None]
    free = np.array(start) + np.array(velocity) * t - [0, 0, GRAVITY / 2] * t**2
    return np.linalg.norm(path - free, axis=1).max()


@pytest.mark.parametrize("rolling", ["constant_torque", "elastic_plastic"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_mesh_does_what_the_analytic_shape_does(record, tmp_path, shape, rolling):
    analytic, (vertices, triangles), start, velocity = SHAPES[shape]
    write_stl(tmp_path / "mesh.stl", vertices, triangles)
    # in the cylinder the grain strikes the flank within 20 ms, and each later bounce multiplies the
    # facets' turn
    steps = 4000 if shape == "cylinder" else 12000
    exact = path(analytic(WallSet().body("w", material="wall")), start, velocity, steps, rolling)
    mesh = WallSet().body("w", material="wall").mesh(*read_stl(tmp_path / "mesh.stl"))
    meshed = path(mesh, start, velocity, steps, rolling)
    # a polygon of 256 sides lies within r (1 - cos(pi/256)) = 1 um of its circle and turns the
    # normal by up to 0.7 degrees, which a few bounces amplify; flat walls have no such error
    tolerance = 4e-4 if shape in ("frustum", "cylinder") else 2e-6
    record(
        "walls",
        f"{shape}, {rolling}: mesh against analytic, largest distance of paths",
        np.abs(exact - meshed).max(),
        0.0,
        tolerance,
        "m",
    )
    free = departure_from_free_flight(exact, start, velocity, steps * TIME_STEP)
    assert free > 5e-4, "the grain never met the wall"


def test_a_box_holds_grains_and_carries_their_weight(record):
    walls = WallSet().body("box", material="wall").box((0, 0, 0), (0.01, 0.01, 0.03))
    sim = make(
        ContactParameters(0.3, 0.4, 0.1),
        laws=Laws(rolling="constant_torque"),
        walls=walls,
        dt=8e-6,
        gravity=GRAVITY,
    )
    grid = (
        np.array([(i, j, k) for k in range(5) for i in range(4) for j in range(4)]) * 2.2e-3
        + 1.2e-3
    )
    sim.add_particles(grid, 1e-3)
    sim.advance(60000)
    before = sim.wall_impulse("box")
    sim.advance(5000)
    mean = (sim.wall_impulse("box") - before)[2] / (5000 * sim.time_step)
    weight = sim.mass.sum() * GRAVITY
    record("walls", "weight carried by a box", -mean, weight, 2e-3 * weight, "N")
    assert (sim.position.min(0) > 0).all()
