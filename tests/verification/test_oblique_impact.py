"""Oblique impact and spin: gross sliding, Chung and Ooi 4 to 8, Kharaz's spins."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from scenes import (
    ContactParameters,
    contact_time,
    effective,
    from_young,
    make,
    mass_of,
    pair_impact,
    plane_impact,
)

OXIDE = from_young(380e9, 0.23, 4000)
ALUMINIUM_ALLOY = from_young(70e9, 0.33, 2700)
GLASS = from_young(70e9, 0.25, 2500)
COPPER = from_young(120e9, 0.35, 8900)
R = 2.5e-3
KHARAZ = pd.read_csv(Path(__file__).parent / "data" / "kharaz_2001.csv", comment="#")


@pytest.mark.parametrize(
    "row", list(KHARAZ.itertuples(index=False)), ids=lambda r: f"{r.angle_deg}deg"
)
def test_chung_ooi_4_oblique_impact(record, row):
    """v = 3.9 m/s, e = 0.98, mu = 0.092; the angle is from the normal."""
    angle = math.radians(row.angle_deg)
    v_n, v_t = 3.9 * math.cos(angle), 3.9 * math.sin(angle)
    sim = plane_impact(
        ContactParameters(0.98, 0.092), v_n, v_t, radius=R, grain=OXIDE, wall=GLASS, steps=400
    )
    e_t, spin = sim.velocity[0, 0] / v_t, -sim.spin[0, 1]
    # the published curve was read off with about 3 %; the experiment scatters by about 10 % and was
    # made at angles within 1.1 degrees of these
    both = "Chung and Ooi 4", "Chung and Ooi (2011)"
    for (topic, source), what, value, known, tolerance, unit in (
        (both, "e_t", e_t, row.tangential_restitution, 0.02, ""),
        (both, "spin", spin, row.spin_rad_s, 0.06 * abs(row.spin_rad_s), "rad/s"),
        (
            ("Kharaz (2001)", "Kharaz et al. (2001)"), "measured spin", spin,
            row.spin_measured_rad_s, 0.15 * abs(row.spin_measured_rad_s), "rad/s",
        ),
    ):  # fmt: skip
        record(topic, f"{what} at {row.angle_deg} deg", value, known, tolerance, unit, source)


@pytest.mark.parametrize("material", ["steel", "polyethylene"])
def test_chung_ooi_5_constant_normal_speed(record, material):
    """Oblique impact with constant normal speed: beyond gross sliding the rebound angle and spin
    grow linearly."""
    grain = {"steel": from_young(208e9, 0.3, 7850), "polyethylene": from_young(1e9, 0.4, 950)}[
        material
    ]
    v_n, mu, e, r = 5.0, 0.3, 1.0, 0.1
    # rigid spheres are not flattened; these lose this share of their lever arm at the deepest point
    k = 4 / 3 * effective(grain)[0] * math.sqrt(r)
    flat = (5 * mass_of(r, grain) * v_n**2 / (4 * k)) ** 0.4 / r
    for factor in (1.2, 2.0, 4.0):
        v_t = 3.5 * factor * mu * (1 + e) * v_n
        sim = plane_impact(
            ContactParameters(e, mu), v_n, v_t, radius=r, grain=grain, wall=grain, steps=300
        )
        psi = 2 * v_t / ((1 + e) * mu * v_n)
        tangential = (sim.velocity[0, 0] - r * sim.spin[0, 1]) / v_n * 2 / ((1 + e) * mu)
        spin = r * sim.spin[0, 1] / (mu * (1 + e) * v_n)
        for what, value, known, tolerance in (
            ("recoil", tangential, psi - 7.0, 0.15),
            ("spin", spin, 2.5, 0.02 + 2.5 * flat),
        ):
            quantity = f"normalised {what}, {material}, psi = {psi:.1f}"
            record("Chung and Ooi 5", quantity, value, known, tolerance, "", "rigid body sliding")


@pytest.mark.parametrize("material", ["aluminium alloy", "copper"])
def test_chung_ooi_6_impact_with_initial_spin(record, material):
    """Normal impact at 0.2 m/s with initial spin, mu = 0.4, e = 0.5: while it slides the spin loses
    5 mu (1+e) v / 2R."""
    grain = {"aluminium alloy": ALUMINIUM_ALLOY, "copper": COPPER}[material]
    v, r, mu, e = 0.2, 0.1, 0.4, 0.5
    for w0 in (-8.0, -16.0, -24.0):
        sim = plane_impact(
            ContactParameters(e, mu),
            v,
            0.0,
            radius=r,
            grain=grain,
            wall=grain,
            steps=400,
            spin=(0, w0, 0),
        )
        gain = mu * (1 + e) * v
        sliding = abs(w0) * r > 3.5 * gain
        if sliding:
            lost = 2.5 * gain / r
            for what, value, known, tolerance, unit in (
                ("tangential velocity", sim.velocity[0, 0], -gain, 0.05 * gain, "m/s"),
                ("spin", sim.spin[0, 1], w0 + lost, 0.05 * lost, "rad/s"),
            ):
                quantity = f"{what}, {material}, {w0} rad/s"
                record("Chung and Ooi 6", quantity, value, known, tolerance, unit)
        else:
            assert -gain * 1.02 <= sim.velocity[0, 0] <= 0


@pytest.mark.parametrize("material", ["aluminium alloy", "copper"])
def test_chung_ooi_7_counter_spin(record, material):
    """Two identical spheres with equal spins about one axis: their surfaces do not slip, so spins
    stay and nothing moves sideways."""
    grain = {"aluminium alloy": ALUMINIUM_ALLOY, "copper": COPPER}[material]
    sim = pair_impact(
        ContactParameters(0.5, 0.4),
        0.4,
        radii=(0.1, 0.1),
        grain=grain,
        steps=300,
        spin=(10.0, -10.0),
    )
    record("Chung and Ooi 7", f"spin kept, {material}", sim.spin[0, 2], 10.0, 1e-3, "rad/s")
    record(
        "Chung and Ooi 7", f"tangential velocity, {material}", sim.velocity[0, 1], 0.0, 1e-6, "m/s"
    )


def test_chung_ooi_8_two_differing_spheres(record):
    """A spinning sphere strikes a smaller one at rest: impulse ratio mu while sliding, angular
    momentum kept."""
    grain, mu, e, v = ALUMINIUM_ALLOY, 0.4, 0.5, 0.2
    r1, r2, w0 = 0.1, 0.02, 200.0
    m1, m2 = mass_of(r1, grain), mass_of(r2, grain)
    dt = contact_time(effective(grain)[0], r1 * r2 / (r1 + r2), m1 * m2 / (m1 + m2), v) / 400
    sim = make(ContactParameters(e, mu), grain=grain, dt=dt)
    sim.add_particles(
        [[0, 0, 0], [r1 + r2 + 0.3 * v * dt, 0, 0]],
        np.array([r1, r2]),
        velocity=[[v, 0, 0], [0, 0, 0]],
        spin=[[0, 0, w0], [0, 0, 0]],
    )
    sim.advance(1600)
    m = m1 * m2 / (m1 + m2)
    normal = (1 + e) * m * v
    speed = normal / m2
    for what, value, known, share, unit in (
        ("normal velocity", sim.velocity[1, 0], speed, 0.01, "m/s"),
        ("tangential velocity", sim.velocity[1, 1], mu * speed, 0.04, "m/s"),
        ("spin", sim.spin[1, 2], -2.5 * mu * speed / r2, 0.04, "rad/s"),
    ):
        quantity = f"{what} of the struck sphere"
        record("Chung and Ooi 8", quantity, value, known, share * abs(known), unit)
