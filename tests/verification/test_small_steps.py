"""Time steps so small that float32 cannot hold what one of them adds: the sums must still be
right."""

import math

import numpy as np
import pytest

from scenes import GRAVITY, ContactParameters, Laws, floor, make


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("dt", [1e-5, 2e-8])
def test_free_fall_gains_g_t_at_every_time_step(record, dt, precision):
    """From 1 m/s, where float32 has steps of 6e-8 m/s and 20 ns of gravity add 2e-7 m/s."""
    sim = make(ContactParameters(0.5, 0.5), dt=dt, gravity=GRAVITY, precision=precision)
    sim.add_particles([[0, 0, 0]], 1e-3, velocity=[[0, 0, -1.0]])
    steps = min(round(0.02 / dt), 200000)
    sim.advance(steps)
    fallen = -sim.position[0, 2]
    time = steps * dt
    # the velocity is that of half a step before; float32 rounds it once more when it is read
    gained = -sim.velocity[0, 2] - 1.0
    expected = GRAVITY * (time - 0.5 * dt)
    assert gained == pytest.approx(expected, rel=1e-5, abs=1.2e-7)
    record(
        "small time steps",
        f"speed gained in free fall over g t, {precision}, steps of {dt:g} s",
        gained / expected,
        1.0,
        1e-5 + 1.2e-7 / expected,
    )
    assert fallen == pytest.approx(time + 0.5 * GRAVITY * time**2, rel=1e-7)


@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_a_spin_under_a_small_torque_decays_as_it_should(precision):
    """A top on one point without sliding friction loses 5 mu_r g t / (2 R), in steps of 1e-5 rad/s
    at 500 rad/s."""
    radius, mu_r, dt = 1e-3, 0.01, 1e-7
    sim = make(
        ContactParameters(0.2, 0.0, mu_r),
        laws=Laws(rolling="constant_torque"),
        walls=floor(),
        dt=dt,
        gravity=GRAVITY,
        precision=precision,
    )
    sim.add_particles([[0, 0, radius]], radius, spin=[[500.0, 0, 0]])
    sim.advance(100000)
    start, spin = sim.time, sim.spin[0, 0]
    sim.advance(200000)
    lost = spin - sim.spin[0, 0]
    expected = 5.0 * mu_r * GRAVITY * (sim.time - start) / (2.0 * radius)
    assert lost == pytest.approx(expected, rel=5e-3)


def test_a_light_step_does_not_move_what_rests():
    """A grain on the floor stays where its weight has pressed it, however many steps it takes."""
    sim = make(
        ContactParameters(0.2, 0.5), walls=floor(), dt=2e-7, gravity=GRAVITY, precision="mixed"
    )
    sim.add_particles([[0, 0, 1e-3]], 1e-3)
    sim.advance(150000)
    before = sim.position[0].copy()
    sim.advance(50000)
    assert np.abs(sim.position[0] - before).max() < 1e-10
    assert math.isfinite(sim.kinetic_energy())
