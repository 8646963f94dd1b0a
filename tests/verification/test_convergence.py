"""The error falls with the time step at the integrator's order."""

import math

import numpy as np
import pytest

from scenes import (
    SALT,
    ContactParameters,
    contact_time,
    effective,
    make,
    mass_of,
    pair_impact,
    plane_impact,
)

R, SPEED = 1e-3, 0.5
COARSE = np.array([20, 40, 80, 160])
DEPTH = 2e-5  # half of the deepest overlap [m]: where the smooth case begins


def overlap_after(share, e, steps, depth=0.0, precision="double"):
    """Approach of two spheres after `share` of the elastic contact time, started at an overlap of
    `depth` [m]."""
    young, m = effective(SALT)[0], mass_of(R, SALT) / 2
    dt = share * contact_time(young, R / 2, m, SPEED) / steps
    sim = make(ContactParameters(e, 0.0), dt=dt, precision=precision)
    # velocities live half a step earlier, when the force of the start had yet to act (at the touch
    # there is none)
    stiffness = 2 * young * math.sqrt(R / 2 * depth)
    force = 2 / 3 * stiffness * depth
    force += sim.properties[0].damping * math.sqrt(stiffness * m) * SPEED
    v = SPEED + 0.5 * dt * force / m
    sim.add_particles(
        [[0, 0, 0], [2 * R - depth, 0, 0]], R, velocity=[[v / 2, 0, 0], [-v / 2, 0, 0]]
    )
    sim.advance(steps)
    x = sim.position
    return 2 * R - (x[1, 0] - x[0, 0])


def errors(e, steps, order, depth=0.0):
    """Relative errors against the limit of vanishing steps, which two long runs give by
    extrapolation."""
    near, nearer = (overlap_after(0.4, e, n, depth) for n in (10240, 20480))
    exact = nearer + (nearer - near) / (2**order - 1)
    return np.array([abs(overlap_after(0.4, e, n, depth) / exact - 1) for n in steps])


def slope(e, steps, order, depth=0.0):
    return -float(np.polyfit(np.log(steps), np.log(errors(e, steps, order, depth)), 1)[0])


@pytest.mark.slow
def test_elastic_contact_is_second_order(record):
    # the force has a kink in its second derivative at the touch, which costs a little
    record("convergence", "order, elastic", slope(1.0, COARSE, 2), 2.0, 0.1, "", "leapfrog")


def slip_after_an_oblique_impact(steps):
    """Tangential velocity over the normal one of an elastic grain that sticks to the plane, struck
    at 45 degrees: mean over the moment of touch within a step."""
    out = []
    for offset in np.linspace(0.05, 0.95, 10):
        sim = plane_impact(ContactParameters(1.0, 10.0), SPEED, SPEED, steps=steps, offset=offset)
        out.append(sim.velocity[0, 0] / SPEED)
    return np.mean(out)


@pytest.mark.slow
def test_an_elastic_contact_that_sticks_is_of_order_one_and_a_half_at_least(record):
    steps = np.array([10, 20, 40, 80])
    exact = slip_after_an_oblique_impact(1280)
    error = np.array([abs(slip_after_an_oblique_impact(n) - exact) for n in steps])
    order = -float(np.polyfit(np.log(steps), np.log(error), 1)[0])
    record("convergence", "order, elastic, oblique, sticking", order, 1.75, 0.25, "", "leapfrog")
    record("convergence", "elastic, oblique: error of the slip, 10 steps", error[0], 0.0, 0.02)


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.3, 0.8])
def test_damped_contact_is_first_order_where_its_force_is_smooth(record, e):
    record(
        "convergence",
        f"order, damped, e = {e}, begun in the contact",
        slope(e, COARSE, 1, DEPTH),
        1.0,
        0.05,
        "",
        "velocity half a step late",
    )


@pytest.mark.slow
def test_the_two_terms_of_the_damped_error_account_for_its_slope(record, figure):
    steps = 20 * 2 ** np.arange(9)
    error, h = errors(0.3, steps, 1), 1.0 / steps
    terms = np.column_stack([h, h**1.25])
    (a, b), *_ = np.linalg.lstsq(terms / error[:, None], np.ones(len(h)), rcond=None)
    assert a > 0 > b
    worst = np.abs(terms @ [a, b] / error - 1).max()
    # two terms over errors that differ by a factor of 125; the next term is of order h^(3/2)
    record("convergence", "damped, a h + b h^(5/4): worst relative misfit", worst, 0.0, 0.1)
    _, ax = figure(
        "convergence",
        "convergence",
        "Error of the overlap at 40 % of the contact time over the number of steps until then.",
    )
    ax.loglog(steps, errors(1.0, steps, 2), "o-", label="elastic")
    ax.loglog(steps, error, "s--", label="damped, e = 0.3, from the touch")
    ax.loglog(
        steps, errors(0.3, steps, 1, DEPTH), "^-.", label="damped, e = 0.3, begun in the contact"
    )
    for order in (1, 2):
        line = 0.02 * (steps / steps[0]) ** -float(order)
        ax.loglog(steps, line, color="#8a8f98", linestyle=":", linewidth=1)
        ax.annotate(f"order {order}", (steps[-1], line[-1]), fontsize=8, ha="right")
    ax.set(xlabel="steps", ylabel="relative error")
    ax.legend(fontsize=8)


@pytest.mark.parametrize("steps", [5, 10, 20, 40, 80])
def test_restitution_over_steps_in_a_contact(record, steps):
    """What too few steps in a contact cost: mean over the moment of touch within a step."""
    out = []
    for offset in np.linspace(0.05, 0.95, 10):
        sim = pair_impact(ContactParameters(0.5, 0.0), SPEED, steps=steps, offset=offset)
        v = sim.velocity[:, 0]
        out.append((v[1] - v[0]) / SPEED)
    # first order: the error is below one half over the number of steps
    record("steps in a contact", f"restitution, {steps} steps", np.mean(out), 0.5, 0.5 / steps)
