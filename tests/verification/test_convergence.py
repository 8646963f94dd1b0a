"""The error falls with the time step at the integrator's order."""

import numpy as np
import pytest
from scenes import SALT, ContactParameters, contact_time, effective, make, mass_of

R, SPEED = 1e-3, 0.5


def overlap_after(share, e, steps, precision="double"):
    """Approach of two spheres after `share` of the elastic contact time, started at the moment of touch."""
    total = contact_time(effective(SALT)[0], R / 2, mass_of(R, SALT) / 2, SPEED)
    dt = share * total / steps
    sim = make(ContactParameters(e, 0.0), dt=dt, precision=precision)
    # the velocity is given at the touch and lives half a step earlier, where it was the same
    sim.add_particles(
        [[0, 0, 0], [2 * R, 0, 0]], R, velocity=[[SPEED / 2, 0, 0], [-SPEED / 2, 0, 0]]
    )
    sim.advance(steps)
    x = sim.position
    return 2 * R - (x[1, 0] - x[0, 0])


def slope(e):
    steps = np.array([20, 40, 80, 160])
    exact = overlap_after(0.4, e, 10240)
    error = [abs(overlap_after(0.4, e, n) - exact) for n in steps]
    return -float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def test_elastic_contact_is_second_order(record):
    # the force has a kink in its second derivative at the touch, which costs a little
    record("convergence", "order, elastic contact", slope(1.0), 2.0, 0.3, "", "leapfrog")


def test_damped_contact_is_first_order(record):
    record(
        "convergence",
        "order, damped contact",
        slope(0.3),
        1.0,
        0.35,
        "",
        "velocity half a step late",
    )


@pytest.mark.parametrize("steps", [5, 10, 20, 40, 80])
def test_restitution_over_steps_in_a_contact(record, steps):
    """What too few steps in a contact cost: mean over the moment of touch within a step."""
    from scenes import pair_impact

    out = []
    for offset in np.linspace(0.05, 0.95, 10):
        sim = pair_impact(ContactParameters(0.5, 0.0), SPEED, steps=steps, offset=offset)
        v = sim.velocity[:, 0]
        out.append((v[1] - v[0]) / SPEED)
    # first order: the error is below one half over the number of steps
    record("steps in a contact", f"restitution, {steps} steps", np.mean(out), 0.5, 0.5 / steps)
