"""Conservation laws and symmetries, as properties that must hold for any draw."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dem.contact.catalogue import LAWS
from dem.kernel.neighbours import NEARLY
from law_cases import alone, values
from scenes import (
    SALT,
    ContactParameters,
    Laws,
    contact_time,
    effective,
    make,
    mass_of,
)

SETTINGS = settings(max_examples=12, deadline=None, derandomize=True)
unit = st.floats(-1, 1)
vector = st.tuples(unit, unit, unit)


def collide(v, w, radii, laws, e=0.7, mu=0.4, mu_r=0.1, precision="double", **more):
    """Free collision of two spheres with relative velocity (1 + |v_x|, v_y, v_z) / 2 m/s and spins
    w [krad/s]."""
    r1, r2 = radii
    m1, m2 = mass_of(r1, SALT), mass_of(r2, SALT)
    speed = 0.5 * (1 + abs(v[0]))
    dt = contact_time(effective(SALT)[0], r1 * r2 / (r1 + r2), m1 * m2 / (m1 + m2), speed) / 60
    sim = make(ContactParameters(e, mu, mu_r, **more), laws=laws, dt=dt, precision=precision)
    velocity = np.array([[speed, 0.3 * v[1], 0.3 * v[2]], [0, 0, 0]])
    spin = 1e3 * np.array([w, w[::-1]])
    sim.add_particles(
        [[0, 0, 0], [r1 + r2 + 0.2 * speed * dt, 0, 0]],
        np.array(radii),
        velocity=velocity,
        spin=spin,
    )
    start = state(sim)
    sim.advance(300)
    return start, state(sim), sim


def state(sim):
    m, r = sim.mass, sim.radius
    inertia = 0.4 * m * r**2
    momentum = (m[:, None] * sim.velocity).sum(0)
    angular = (np.cross(sim.position, m[:, None] * sim.velocity) + inertia[:, None] * sim.spin).sum(
        0
    )
    return momentum, angular, sim.kinetic_energy()


TOGETHER = [
    Laws(normal="linear", damping="linear", tangential="linear", rolling="elastic_plastic"),
    Laws(normal="eepa", damping="none", rolling="none", torsion="marshall"),
]
"""Laws that meet in one contact, beside each law alone."""

OWN_SPIN = {name for name, law in LAWS["rolling"].items() if "resistance" in law.kernels}
"""Laws whose torque on each own spin has no counterpart: see test_rolling and test_energy."""

PAIR_LAWS = dict.fromkeys(
    laws for _, laws in alone(rolling="none") if laws.rolling not in OWN_SPIN
) | dict.fromkeys(TOGETHER)


@pytest.mark.slow
@pytest.mark.parametrize("laws", PAIR_LAWS, ids=lambda laws: "-".join(vars(laws).values()))
@SETTINGS
@given(v=vector, w=vector, ratio=st.floats(1, 4))
def test_momentum_angular_momentum_and_energy(laws, v, w, ratio):
    before, after, sim = collide(v, w, (1e-3, ratio * 1e-3), laws, **values(laws))
    m, r = sim.mass.sum(), sim.radius.max()
    assert np.abs(after[0] - before[0]).max() < 1e-12 * m
    # velocities lag the positions by half a step, so the moment of momentum is known to a(n) dt / 2
    # only while in contact
    assert np.abs(after[1] - before[1]).max() < 1e-6 * m * r * 1.0
    assert after[2] <= before[2] * (1 + 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["constant_torque", "constant_torque_relative"])
@SETTINGS
@given(w=st.floats(0.001, 5), mu_r=st.floats(0.01, 5))
def test_rolling_torque_never_reverses_a_spin(law, w, mu_r):
    _, _, sim = collide(
        (0, 0, 0), (0.0, 0.0, w), (1e-3, 1e-3), Laws(rolling=law), mu=0.0, mu_r=mu_r
    )
    relative = sim.spin[0] - sim.spin[1]
    assert sim.spin[0, 2] >= -1e-9
    assert relative[2] >= -1e-9


def thrown():
    """Positions, velocities, spins (12, 3) and radii (12,) of twelve grains of three sizes about to
    meet."""
    rng = np.random.default_rng(5)
    x = np.array([(i, j, k) for i in range(3) for j in range(2) for k in range(2)]) * 2.05e-3
    v = -120.0 * (x - x.mean(0)) + rng.normal(0, 0.02, x.shape)
    return x, v, rng.normal(0, 50, x.shape), 1e-3 * np.array([1.0, 0.98, 0.96] * 4)


axis = vector.filter(lambda v: np.linalg.norm(v) > 0.1)


@SETTINGS
@given(
    ratio=st.floats(1, 10),
    n=st.integers(2, 800),
    box=st.tuples(*[st.floats(0.01, 0.06)] * 3),
    seed=st.integers(0, 2**32 - 1),
    stray=st.sampled_from([0.0, 1.0, 1e4]),
)
@example(ratio=10.0, n=800, box=(0.016, 0.016, 0.016), seed=10, stray=0.0)
@example(ratio=2.0, n=400, box=(0.016, 0.016, 0.016), seed=10, stray=1e4)
def test_the_list_holds_exactly_the_pairs_within_reach(ratio, n, box, seed, stray):
    """Grains thrown into a box at random, through each other if need be: radii from 1 mm down to 1
    mm / ratio; one of them `stray` [m] away. Pairs that touch come first, and rows ascend: the
    order in which forces are summed does not depend on how the pairs are searched."""
    rng = np.random.default_rng(seed)
    radius, x = 1e-3 * rng.uniform(1 / ratio, 1, n), rng.uniform(0, box, (n, 3))
    x[0] += stray
    sim = make(ContactParameters(0.5, 0.5), dt=5e-6)
    sim.add_particles(x, radius, velocity=rng.normal(0, 0.3, (n, 3)))
    sim.rebuild_lists()
    p, tag = sim.particles, sim.particles.tag
    first, second = (
        sim._pairs.first[: sim.candidate_pairs],
        sim._pairs.second[: sim.candidate_pairs],
    )
    real = first < n
    found = {
        tuple(sorted((tag[a], tag[b]))) for a, b in zip(first[real], second[real], strict=True)
    }
    reach = p.kinetic[:n, 6].astype(float) + np.sqrt(p.drift[:n, 3])
    gap = np.linalg.norm(p.position[:n, None, :3] - p.position[None, :n, :3], axis=2)
    i, j = np.nonzero(np.triu(gap < reach[:, None] + reach[None], 1))
    assert len(found) == real.sum()
    assert found == {tuple(sorted((tag[a], tag[b]))) for a, b in zip(i, j, strict=True)}
    rows = np.column_stack([first[real], second[real]])
    touch = NEARLY * (p.kinetic[rows[:, 0], 6] + p.kinetic[rows[:, 1], 6])
    apart = gap[rows[:, 0], rows[:, 1]] >= touch
    assert np.array_equal(np.lexsort((rows[:, 1], rows[:, 0], apart)), np.arange(len(rows)))
