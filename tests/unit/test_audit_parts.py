import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dem.contact.registry import Material
from dem.timescales import hertz_contact_time
from paper.audit.bench import (
    stepped_restitution,
)
from paper.audit.paper import Found


def test_verdict_follows_the_printed_place():
    for printed, found, holds in (
        ("0.50", Found(0.5049), True),
        ("0.50", Found(0.5051), False),
        ("0.5", Found(0.5499), True),
        ("0.50", Found(0.5051, half_width=0.001), True),
        ("0.3", Found(0.35, exact=True), False),
        ("3", Found(2), False),
        ("3", Found(np.int64(2)), False),
        ("<0.01", Found(0.009), True),
        ("<0.01", Found(0.0101), False),
        (">0.05", Found(0.04), False),
        ("A B", Found("A B"), True),
        ("A B", Found(None), None),
        ("0.3", Found(float("nan")), False),
    ):
        assert found.compared(printed)[0] == holds


def test_contact_time_is_that_of_the_integrated_elastic_impact():
    radius, speed, salt = 1e-3, 1.7, Material(1210.0, 1.9e9, 0.25)
    stiff = Material(7800.0, 1e18, 0.3)
    mass = 4 / 3 * np.pi * radius**3 * salt.density
    modulus = salt.young_modulus / (1 - salt.poisson_ratio**2)
    k = 4 / 3 * modulus * np.sqrt(radius)

    def leaves(t, state):
        return state[0]

    leaves.terminal, leaves.direction = True, -1
    flight = solve_ivp(
        lambda t, s: [s[1], -k * max(s[0], 0) ** 1.5 / mass],
        (0, 1e-3), [0, speed], events=leaves, rtol=1e-9, atol=1e-15, max_step=1e-7,
    )  # fmt: skip
    found = hertz_contact_time(radius, speed, salt, stiff)
    assert found == pytest.approx(flight.t_events[0][-1], rel=1e-4)


def test_many_steps_give_the_nominal_restitution_and_few_do_not():
    e = np.array([0.2, 0.5, 0.8])
    fine, coarse = stepped_restitution(e, 2000, phases=4), stepped_restitution(e, 3)
    assert fine == pytest.approx(np.broadcast_to(e[:, None], fine.shape), abs=2e-3)
    assert np.ptp(coarse, axis=1).min() > 20 * np.ptp(fine, axis=1).max()


def test_stepped_error_falls_with_the_step():
    errors = [
        abs(stepped_restitution(np.array([0.5]), n, phases=20).mean() - 0.5)
        for n in (50, 100, 200, 400)
    ]
    slope = np.polyfit(np.log([50, 100, 200, 400]), np.log(errors), 1)[0]
    assert -1.3 < slope < -0.7  # semi-implicit Euler is of first order
