"""Joints of walls: wherever the elements of a body meet there is one contact, however the body is
cut."""

import math

import numpy as np
import pytest
from hypothesis import settings

from facts import refused
from scenes import ContactParameters, body, make

R = 1e-3
DT = 2e-6
SETTINGS = settings(max_examples=12, deadline=None, derandomize=True)


def seam():
    return body().rectangle((-0.05, 0, 0), (0.05, 0, 0), (0, 0.05, 0)).rectangle(
        (0.05, 0, 0), (0.05, 0, 0), (0, 0.05, 0)
    )  # fmt: skip


def quarters():
    walls = body()
    for x in (-0.05, 0.05):
        for y in (-0.05, 0.05):
            walls.rectangle((x, y, 0), (0.05, 0, 0), (0, 0.05, 0))
    return walls


def box():
    return body().box((0, 0, 0), (0.02, 0.02, 0.02), lid=True)


def stem():
    return body().frustum(0.01, 0, 0.03, 0.02).cylinder(0.01, -0.02, 0)


def crossed():
    """The lower triangles have one long edge where the upper ones have a vertex: T-junctions at x =
    0."""
    vertices = [
        (-0.05, -0.05, 0), (0, -0.05, 0), (0, 0.05, 0), (-0.05, 0.05, 0),
        (0.05, -0.05, 0), (0.05, 0, 0), (0.05, 0.05, 0), (0, 0, 0),
    ]  # fmt: skip
    return body().mesh(vertices, [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 7), (7, 5, 6), (7, 6, 2)])


def fan(n):
    """n triangles around a vertex."""
    turn = 2 * math.pi * np.arange(n) / n
    rim = np.column_stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), np.zeros(n)])
    return body().mesh(np.vstack([rim, [(0, 0, 0)]]), [(k, (k + 1) % n, n) for k in range(n)])


def plate(thickness):
    """A closed plate thinner than the overlap of a grain on it."""
    return body().box((-0.05, -0.05, -thickness), (0.05, 0.05, 0), lid=True)


def overlaid():
    """Rectangles that overlap in part, and a plane below which they do not reach."""
    return body().plane((0, 0, 0), (0, 0, 1)).rectangle(
        (0.01, 0, 0), (0.02, 0, 0), (0, 0.02, 0)
    ).rectangle((-0.01, 0, 0), (0.02, 0, 0), (0, 0.02, 0))  # fmt: skip


UP, RIDGE = (0, 0, 1), (-math.cos(math.pi / 8), 0, math.sin(math.pi / 8))
JOINTS = {
    # name: walls, point of the joint, direction from which the grain comes
    "one rectangle": (
        lambda: body().rectangle((0, 0, 0), (0.05, 0, 0), (0, 0.05, 0)),
        (0, 0, 0),
        UP,
    ),
    "the seam of two rectangles": (seam, (0, 0, 0), UP),
    "four rectangles": (quarters, (0, 0, 0), UP),
    "a disc in its ring": (lambda: body().disc(0.02).revolved(0.02, 0, 0.05, 0), (0.02, 0, 0), UP),
    "the outer edge of a box": (box, (0, 0.01, 0), (-1, 0, -1)),
    "the outer corner of a box": (box, (0, 0, 0), (-1, -1, -1)),
    "a cone on its stem": (stem, (0.01, 0, 0), RIDGE),
    "a T-junction": (crossed, (0, 0.01, 0), UP),
    "a hanging vertex": (crossed, (0, 0, 0), UP),
    "a fan of nine triangles": (lambda: fan(9), (0, 0, 0), UP),
    "a thin plate": (lambda: plate(1e-6), (0.01, 0.01, 0), UP),
    "surfaces laid on each other": (overlaid, (0.005, 0, 0), UP),
}


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("joint", JOINTS)
def test_restitution_at_a_joint_is_that_of_a_single_wall(joint, precision):
    walls, point, direction = JOINTS[joint]
    n = np.array(direction, float) / np.linalg.norm(direction)
    sim = make(ContactParameters(0.5, 0.0), walls=walls(), dt=DT, precision=precision)
    sim.add_particles([np.array(point) + 1.001 * R * n], R, velocity=[-n])
    sim.advance(1000)
    assert sim.velocity[0] @ n == pytest.approx(0.5, abs=0.01)
    assert np.linalg.norm(np.cross(sim.velocity[0], n)) < 0.01


@pytest.mark.parametrize("wall", ["plane", "rectangle", "triangles", "disc"])
@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_a_grain_that_goes_through_a_wall_is_an_error(wall, precision):
    from dem.errors import BlowUpError

    walls = {
        "plane": lambda: body().plane((0, 0, 0), (0, 0, 1)),
        "rectangle": seam,
        "triangles": crossed,
        "disc": lambda: body().disc(0.05),
    }[wall]()
    sim = make(ContactParameters(0.5, 0.3), walls=walls, dt=4e-6, precision=precision)
    sim.model = sim.model._replace(overlap_limit=0.3)
    sim.add_particles([(0, 0.001, 2 * R)], R, velocity=[(0, 0, -40.0)])
    with refused(BlowUpError, particle=0, time=3.6e-05):
        sim.advance(200)
