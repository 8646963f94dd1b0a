"""Several threads give the numbers of one, to the bit."""

import numpy as np
import pytest

from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import DemError
from dem.kernel import threads as team
from dem.simulation import Air, Simulation
from dem.walls.builder import WallSet
from facts import refused

RADIUS = 1e-3
CONTACT = ContactParameters(0.5, 0.5, 0.1)


@pytest.fixture(autouse=True)
def few_grains_are_enough(monkeypatch):
    monkeypatch.setattr(team, "LEAST", 1)


def stirred(threads, precision="mixed", pairs_of_grains=0, air=None):
    """180 grains of two materials and two sizes, thrown about between a floor, two walls, a plate
    that turns and a lid that rests on them."""
    rng = np.random.default_rng(3)
    walls = WallSet().body("box", material="steel")
    width = 0.0142
    for point, normal in (
        ((0, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (0, 1, 0)),
        ((width, 0, 0), (-1, 0, 0)),
        ((0, width, 0), (0, -1, 0)),
    ):
        walls.plane(point, normal)
    walls.body("plate", material="steel", origin=(0.006, 0.006, 0.0), spin=(0.0, 0.0, 40.0))
    walls.disc(0.004, 0.0004)
    fall = {"mass": 2e-4, "axis": (0.0, 0.0, 1.0), "load": -0.2}
    walls.body("lid", material="steel", free=fall)
    walls.plane((0, 0, 0.03 if pairs_of_grains else 0.0125), (0, 0, -1))
    names = ("salt", "sand", "steel")
    sim = Simulation(
        {name: Material(1200.0 + 500.0 * k, 1e7, 0.25) for k, name in enumerate(names)},
        {(a, b): CONTACT for a in names for b in names},
        laws=Laws(rolling="elastic_plastic"),
        time_step=1e-5,
        precision=precision,
        walls=walls,
        air=air,
        threads=threads,
    )
    grid = np.stack(np.meshgrid(*[np.arange(6)] * 2, np.arange(5)), -1).reshape(-1, 3)
    place = (2.2 * grid + 1.5) * RADIUS
    for k, name in enumerate(names[:2]):
        own = place[k::2]
        speed = rng.uniform(-0.5, 0.5, own.shape)
        radius = RADIUS * rng.uniform(0.7, 1.0, len(own))
        sim.add_particles(own, radius, velocity=speed, material=name)
    if pairs_of_grains:
        centre = np.column_stack(
            [rng.uniform(2, 10, (pairs_of_grains, 2)), 14 + 3 * np.arange(pairs_of_grains)]
        )
        arm = np.array([[0.6, 0, 0], [-0.6, 0, 0]])
        sim.add_clusters((centre[:, None] + arm) * RADIUS, RADIUS)
    return sim


def last(sim, steps=3000):
    """All that a run leaves: motion, and what the walls have felt."""
    sim.advance(steps)
    felt = [
        f(name)
        for name in ("box", "plate", "lid")
        for f in (sim.wall_impulse, sim.wall_angular_impulse)
    ]
    return [sim.position, sim.velocity, sim.spin, *felt]


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


CASES = {
    "mixed precision": {},
    "double precision": {"precision": "double"},
    "clusters in air": {"pairs_of_grains": 4, "air": Air()},
}


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=pytest.mark.slow) if CASES[c] else c for c in CASES]
)
def test_the_numbers_do_not_depend_on_the_threads(case):
    alone = stirred(1, **CASES[case])
    expected = last(alone)
    assert len(alone.contacts()[0]) > 100
    for threads in (2, 5) if case == "mixed precision" else (3,):
        sim = stirred(threads, **CASES[case])
        assert same(last(sim), expected)
        assert len(sim._shares) == threads
        assert all(len(share.inbox) for share in sim._shares[:-1])  # they did meet


def test_a_checkpoint_goes_on_with_another_number_of_threads():
    expected = last(stirred(1), 1000)
    begun = stirred(3)
    begun.advance(437)
    saved = {k: np.array(v) for k, v in begun.state_dict().items()}
    for threads in (1, 2):
        sim = stirred(threads)
        sim.restore(saved)
        assert same(last(sim, 1000 - 437), expected)


def test_an_overlap_is_told_by_all_threads_as_by_one():
    told = []
    for threads in (1, 3):
        sim = stirred(threads)
        sim.advance(100)
        sim.add_particles([sim.position[40] + 1e-4], RADIUS, material="salt")
        with refused(Exception, particle=40, time=0.001) as error:
            sim.advance(100)
        told.append(str(error.value))
    assert told[0] == told[1]


def test_a_thread_has_enough_to_do(monkeypatch):
    monkeypatch.setattr(team, "LEAST", 100)
    sim = stirred(4)
    sim.advance(1)
    assert len(sim._shares) == 1  # 180 grains


@pytest.mark.parametrize("text", ["0", "two", "1.5"])
def test_a_wrong_number_of_threads_is_refused(text, monkeypatch):
    monkeypatch.setenv(team.VARIABLE, text)
    with refused(DemError, "DEM_THREADS", "1"):
        team.threads_chosen()
