"""Normal impact: Hertz peak and duration, restitution, velocity-dependent restitution, bouncing."""

import math
from itertools import pairwise

import numpy as np
import pytest

from dem.contact.damping.plastic import yield_pressure
from dem.materials import contact_parameters
from dem.spec import parse_spec
from scenes import (
    SALT,
    ContactParameters,
    Laws,
    contact_time,
    effective,
    floor,
    from_young,
    make,
    mass_of,
    pair_impact,
    plane_impact,
)

ELASTIC = ContactParameters(1.0, 0.0)


def peak(sim, steps):
    """Largest normal force on particle 1 and largest approach while `steps` steps are run."""
    force, overlap = 0.0, 0.0
    for _ in range(steps):
        sim.advance(1)
        force = max(force, float(np.abs(sim.particles.force[: sim.n, :3]).max()))
        x, r = sim.position, sim.radius
        gap = np.linalg.norm(x[1] - x[0]) - r.sum() if sim.n == 2 else x[0, 2] - r[0]
        overlap = max(overlap, -gap)
    return force, overlap


CHUNG_OOI_1 = [
    ("glass", 48e9, 0.20, 2800, 10.70e3, 274.1e-6),
    ("limestone", 20e9, 0.25, 2500, 7.11e3, 368.3e-6),
]
CHUNG_OOI_2 = [
    ("aluminium alloy", 70e9, 0.30, 2699, 11.37e3, 49.7e-6),
    ("magnesium alloy", 40e9, 0.35, 1800, 7.23e3, 52.1e-6),
]


def peaks(record, topic, what, found, printed):
    """Peak force [N] and overlap [m] beside the published ones, which carry four digits; 200 steps
    a contact resolve the peak to 1e-4."""
    rows = zip(("peak force", "overlap"), found, printed, "Nm", strict=True)
    for name, value, known, unit in rows:
        source = "Chung and Ooi (2011)"
        record(topic, f"{name}, {what}", value, known, 2e-3 * known, unit, source)


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize(("name", "young", "nu", "rho", "force", "overlap"), CHUNG_OOI_1)
def test_chung_ooi_1_two_equal_spheres(record, precision, name, young, nu, rho, force, overlap):
    grain, r = from_young(young, nu, rho), 0.01
    m = mass_of(r, grain) / 2
    dt = contact_time(effective(grain)[0], r / 2, m, 20.0) / 200
    sim = make(ELASTIC, grain=grain, dt=dt, precision=precision)
    sim.add_particles([[0, 0, 0], [2 * r + 2 * dt, 0, 0]], r, velocity=[[10, 0, 0], [-10, 0, 0]])
    f, a = peak(sim, 220)
    peaks(record, "Chung and Ooi 1", f"{name}, {precision}", (f, a), (force, overlap))


@pytest.mark.parametrize(("name", "young", "nu", "rho", "force", "overlap"), CHUNG_OOI_2)
def test_chung_ooi_2_sphere_on_rigid_plane(record, name, young, nu, rho, force, overlap):
    grain, r = from_young(young, nu, rho), 0.1
    rigid = from_young(young * 1e6, nu, rho)
    dt = contact_time(effective(grain, rigid)[0], r, mass_of(r, grain), 0.2) / 200
    sim = make(ELASTIC, grain=grain, wall=rigid, walls=floor(), dt=dt)
    sim.add_particles([[0, 0, r + 0.02 * dt]], r, velocity=[[0, 0, -0.2]])
    f, a = peak(sim, 220)
    peaks(record, "Chung and Ooi 2", name, (f, a), (force, overlap))


@pytest.mark.parametrize("material", ["aluminium oxide", "cast iron"])
@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
def test_chung_ooi_3_restitution_in_is_restitution_out(record, material, e):
    grain = {
        "aluminium oxide": from_young(380e9, 0.23, 4000),
        "cast iron": from_young(100e9, 0.25, 7000),
    }[material]
    sim = plane_impact(ContactParameters(e, 0.0), 3.9, radius=2.5e-3, grain=grain)
    record(
        "Chung and Ooi 3",
        f"restitution, {material}",
        sim.velocity[0, 2] / 3.9,
        e,
        2e-3,
        "",
        "restitution asked for",
    )


def test_chung_ooi_3_no_restitution(record):
    """At e = 0 the contact is damped critically: it stops the sphere and lets go of it only in the
    long run."""
    v, r = 3.9, 2.5e-3
    grain = from_young(380e9, 0.23, 4000)
    sim = plane_impact(ContactParameters(0.0, 0.0), v, radius=r, grain=grain)
    speeds = [sim.velocity[0, 2] / v]
    for _ in range(9):
        sim.advance(800)
        speeds.append(sim.velocity[0, 2] / v)
    assert all(a >= b >= 0 for a, b in pairwise(speeds)), speeds
    # 40 contact times after the touch; what is left falls further
    record(
        "Chung and Ooi 3",
        "restitution, aluminium oxide",
        speeds[-1],
        0.0,
        2e-3,
        "",
        "restitution asked for",
    )


@pytest.mark.parametrize("damping", ["tsuji", "thornton"])
@pytest.mark.parametrize("radii", [(1e-3, 1e-3), (1e-3, 3e-3)])
@pytest.mark.parametrize("e", [0.05, 0.5, 0.95])
def test_restitution_of_pairs(record, damping, radii, e):
    sim = pair_impact(
        ContactParameters(e, 0.0),
        0.5,
        radii=radii,
        steps=200,
        laws=Laws(damping=damping, rolling="none"),
    )
    v = sim.velocity[:, 0]
    record(
        "restitution",
        f"pair, {damping}, sizes 1:{radii[1] / radii[0]:g}",
        (v[1] - v[0]) / 0.5,
        e,
        3e-3,
    )


def slope(x, y):
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def test_viscoelastic_restitution_falls_as_the_fifth_root_of_speed(record):
    contact = ContactParameters(0.5, 0.0, viscous_time=2e-7)
    speeds = np.array([0.02, 0.1, 0.5, 2.5])
    e = [
        plane_impact(
            contact, v, steps=800, laws=Laws(damping="viscoelastic", rolling="none")
        ).velocity[0, 2]
        / v
        for v in speeds
    ]
    # leading order in A; the next order bends the line by about (1 - e) / 2
    record(
        "viscoelastic",
        "exponent of 1 - e over speed",
        slope(speeds, 1 - np.array(e)),
        0.2,
        0.02,
        "",
        "Brilliantov et al. (1996)",
    )


def test_plastic_restitution_falls_as_the_fourth_root_of_speed(record):
    r, v_yield = 1e-3, 0.01
    p = yield_pressure(v_yield, SALT, r)
    contact = ContactParameters(1.0, 0.0, yield_pressure=p)
    laws = Laws(damping="plastic", rolling="none")
    speeds = np.array([1.0, 2.0, 4.0])
    e = [
        plane_impact(contact, v, steps=400, wall=SALT, laws=laws).velocity[0, 2] / v for v in speeds
    ]
    record(
        "plastic",
        "exponent of e over speed, v >> v_yield",
        slope(speeds, e),
        -0.25,
        0.02,
        "",
        "Thornton (1997)",
    )
    below = plane_impact(contact, 0.5 * v_yield, steps=400, wall=SALT, laws=laws).velocity[0, 2] / (
        0.5 * v_yield
    )
    record("plastic", "restitution below yield", below, 1.0, 2e-3, "", "elastic")


def test_one_yield_speed_is_one_material(record):
    """The pressure is that of the grain's material in both of its contacts; at the stated speed a
    grain on a rigid flat just yields, so it rebounds with all of its speed below and not above; two
    grains that meet with opposite speeds have a rigid flat between them, their plane of
    symmetry."""
    v_yield, r = 0.1, 1e-3
    spec = parse_spec(
        {
            "experiment": "drop",
            "laws": {"damping": "plastic"},
            "law_parameters": {"yield_velocity_m_s": v_yield},
            "particles": {"diameter_mm": 2e3 * r},
        }
    )
    between, on_wall = (contact_parameters(spec)["particle", k] for k in ("particle", "wall"))
    assert between.yield_pressure == on_wall.yield_pressure
    laws = Laws(damping="plastic", rolling="none")
    elastic = ContactParameters(1.0, 0.0, yield_pressure=yield_pressure(v_yield, SALT, r))
    rigid = from_young(1e16, 0.3, 7800)
    for share, lost in ((0.99, 0.0), (1.4, None), (3.0, None)):
        v = share * v_yield
        on_flat = plane_impact(elastic, v, steps=2000, wall=rigid, laws=laws).velocity[0, 2] / v
        both = 2 * v
        sim = pair_impact(elastic, both, steps=2000, laws=laws)
        pair = (sim.velocity[1, 0] - sim.velocity[0, 0]) / both
        if lost is not None:
            record("plastic", "restitution on a rigid flat, 1 % below yield", on_flat, 1, 1e-4)
            record("plastic", "restitution of two grains, 1 % below yield", pair, 1, 1e-4)
        else:
            assert on_flat < 1 - 1e-3
            record(
                "plastic", f"two grains against a rigid flat, v = {share} v_y", pair, on_flat, 1e-3
            )


@pytest.mark.slow
def test_simplified_jkr_pulls_with_its_energy_density(record):
    r, k, overlap = 1e-3, 5e4, 1e-6
    contact = ContactParameters(1.0, 0.0, cohesion_energy_density=k)
    sim = make(contact, laws=Laws(rolling="none", cohesion="sjkr"), dt=5e-6, precision="double")
    sim.add_particles([[0, 0, 0], [2 * r - overlap, 0, 0]], r)
    sim.advance(1)
    force = float(sim.particles.force[sim.row_of[1], 0])
    young, _ = effective(SALT)
    expected = 4 / 3 * young * math.sqrt(r / 2) * overlap**1.5 - k * math.pi * r / 2 * overlap
    record("SJKR", "force at 1 um overlap", force, expected, 0.01 * abs(expected), "N")
