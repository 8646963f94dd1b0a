"""The normal laws with a loading path of their own: their force loops to rounding, and what an
impact returns."""

import math

import numpy as np
import pytest

from dem.contact.registry import pair_properties
from dem.kernel.simd import FIELDS
from scenes import SALT, ContactParameters, Laws, effective, led, make, mass_of

R, K, D = 1e-3, 800.0, 2e-5
SPRING = {"normal_stiffness": K}
LINEAR = Laws(normal="linear", damping="linear", tangential="linear", rolling="none")
WALTON_BRAUN = Laws(normal="walton_braun", damping="none", tangential="linear", rolling="none")
EEPA = Laws(normal="eepa", damping="none", rolling="none")
RADIUS = R / 2  # effective, of two spheres of R


def forces(laws, overlaps, shear=None, **constants):
    """Normal and tangential force (n, 2) [N] of equal grains that are led from where they touch
    through overlaps (n,) [m] and shears (n,) [m], without the dashpots' share: the mass is 0."""
    contact = ContactParameters(constants.pop("e", 1.0), constants.pop("mu", 0.5), **constants)
    p = pair_properties(laws, SALT, SALT, contact)
    path = np.zeros((len(overlaps) + 1, 4))
    path[1:, 0] = overlaps
    path[1:, 1] = 0.0 if shear is None else shear
    return led(laws.codes(), p, 1.0, path, RADIUS, R, 1.0, 0.0, (0.0,) * FIELDS)[0][:, :2]


def impact(laws, speed, duration, *, steps=2000, offset=0.3, **constants):
    """Rebound over impact speed of two equal grains that touch for about `duration` [s], and the
    time in contact."""
    contact = ContactParameters(constants.pop("e", 1.0), 0.0, **constants)
    sim = make(contact, laws=laws, dt=duration / steps, precision="double")
    gap = offset * speed * sim.time_step
    velocity = [[speed / 2, 0, 0], [-speed / 2, 0, 0]]
    sim.add_particles([[0, 0, 0], [2 * R + gap, 0, 0]], R, velocity=velocity)
    touching = 0
    for _ in range(2 * steps // 20):
        sim.advance(20)
        touching += 20 * (sim.position[1, 0] - sim.position[0, 0] < 2 * R)
    return (sim.velocity[1, 0] - sim.velocity[0, 0]) / speed, touching * sim.time_step


UP = np.linspace(0, D, 41)
# up, down without parting, up beyond the first turn, and down until the spheres part
LOOP = np.concatenate([UP, UP[:3:-1], np.linspace(UP[4], 2 * D, 60), 2 * UP[::-1]])


def close(found, wanted, force):
    assert np.abs(found - wanted).max() < 1e-13 * force


def test_the_linear_spring_has_one_branch():
    found = forces(LINEAR, LOOP, **SPRING)[:, 0]
    close(found, K * LOOP, K * D)


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.3, 0.7])
@pytest.mark.parametrize("speed", [0.05, 2.0])
def test_the_linear_dashpot_returns_e_at_any_speed(record, e, speed):
    """Half a period of a damped oscillator: restitution e after pi/w_d, w_d^2 = k/m* - (beta
    w)^2."""
    mass = mass_of(R, SALT) / 2
    beta = -math.log(e) / math.hypot(math.log(e), math.pi)
    duration = math.pi / math.sqrt(K / mass * (1 - beta**2))
    returned, lasted = impact(LINEAR, speed, duration, e=e, **SPRING)
    name = f"linear spring-dashpot, e = {e}, {speed} m/s"
    record("linear laws", f"restitution, {name}", returned, e, 2e-3)
    # read every 20 of 2000 steps
    record("linear laws", f"duration over pi/w_d, {name}", lasted / duration, 1.0, 0.02)


def test_a_linear_tangential_spring_has_its_share_of_the_stiffness():
    """Before it slips the force is kappa k s whatever the overlap did meanwhile; then mu F_n."""
    kappa, mu = 0.4, 0.5
    shear = np.concatenate([np.linspace(0, 0.2 * D, 40), np.linspace(0.2 * D, 3 * D, 60)])
    overlap = np.concatenate([np.linspace(0.5 * D, D, 40), np.full(60, D)])
    found = forces(LINEAR, overlap, shear, mu=mu, stiffness_ratio=kappa, **SPRING)
    wanted = -np.minimum(kappa * K * shear, mu * found[:, 0])
    close(found[:, 1], wanted, K * D)


def walton_braun(overlaps, e):
    """Force (n,) along overlaps (n,), from the definition: the unloading line through the deepest
    point, or loading."""
    deepest, out = 0.0, []
    for x in overlaps:
        deepest = max(deepest, x)
        unloading = K * deepest - K / e**2 * (deepest - x)
        out.append(max(min(K * x, unloading), 0.0))
    return np.array(out)


@pytest.mark.parametrize("e", [0.5, 0.9])
def test_walton_brauns_loop(e):
    close(forces(WALTON_BRAUN, LOOP, e=e, **SPRING)[:, 0], walton_braun(LOOP, e), K * D)


@pytest.mark.slow
@pytest.mark.parametrize("e", [0.4, 0.8])
@pytest.mark.parametrize("speed", [0.05, 2.0])
def test_walton_brauns_restitution_is_the_root_of_the_stiffnesses(record, e, speed):
    mass = mass_of(R, SALT) / 2
    duration = math.pi / 2 * math.sqrt(mass / K) * (1 + e)
    returned, _ = impact(WALTON_BRAUN, speed, duration, e=e, **SPRING)
    # the turn at the deepest point falls between two steps
    record("linear laws", f"restitution, Walton-Braun, e = {e}, {speed} m/s", returned, e, 2e-3)


YOUNG = effective(SALT)[0]
K1 = 4 / 3 * YOUNG * math.sqrt(RADIUS)


def eepa(overlaps, ratio, energy):
    """Force (n,) along overlaps (n,) from the three branches of the model, f_min = (3/2) pi g
    a_p."""
    k2, deepest, out = K1 / (1 - ratio), 0.0, []
    for x in overlaps:
        deepest = max(deepest, x)
        plastic = ratio ** (2 / 3) * deepest
        least = min(1.5 * math.pi * energy * math.sqrt(RADIUS * plastic), 0.5 * k2 * plastic**1.5)
        corner = plastic**1.5 - least / k2  # overlap^(3/2) where the adhesion branch begins
        second = k2 * (x**1.5 - plastic**1.5)
        third = -least * x**1.5 / corner if corner > 0 else 0.0
        out.append(min(K1 * x**1.5, max(second, third)))
    return np.array(out)


@pytest.mark.parametrize("ratio", [0.3, 0.8])
@pytest.mark.parametrize("energy", [0.0, 0.05, 50.0])
def test_the_three_branches_of_eepa(ratio, energy):
    found = forces(EEPA, LOOP, plasticity=ratio, adhesion_energy=energy)[:, 0]
    wanted = eepa(LOOP, ratio, energy)
    assert np.abs(found - wanted).max() < 1e-11 * wanted.max()
    assert (wanted < 0).any() == (energy > 0)


def test_eepa_pulls_the_more_the_harder_it_was_pressed(record):
    """Where the pull is least stiff against k2 it is (3/2) pi g sqrt(R* x_p): it goes with the
    square root of the deepest overlap."""
    energy, ratio = 0.01, 0.6
    pulls = []
    for deepest in (D, 4 * D):
        path = np.concatenate([np.linspace(0, deepest, 2), np.linspace(deepest, 0, 200001)])
        pulls.append(-forces(EEPA, path, plasticity=ratio, adhesion_energy=energy)[:, 0].min())
        wanted = 1.5 * math.pi * energy * math.sqrt(RADIUS * ratio ** (2 / 3) * deepest)
        record(
            "EEPA", f"pull-off after {deepest * 1e6:.0f} um", pulls[-1], wanted, 1e-3 * wanted, "N"
        )
    assert pulls[1] / pulls[0] == pytest.approx(2.0, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.05, 1.0])
def test_eepa_without_adhesion_returns_what_its_branches_say(record, speed):
    """e^2 is the area under unloading over that under loading; both go with the deepest overlap to
    the 5/2, so e does not depend on the speed."""
    ratio, mass = 0.6, mass_of(R, SALT) / 2
    x = ratio ** (2 / 3)
    area = (0.4 * (1 - x**2.5) - ratio * (1 - x)) / (1 - ratio)
    expected = math.sqrt(area / 0.4)
    deepest = (5 * mass * speed**2 / (4 * K1)) ** 0.4
    returned, _ = impact(EEPA, speed, 2.943 * deepest / speed, plasticity=ratio)
    record("EEPA", f"restitution without adhesion, {speed} m/s", returned, expected, 2e-3)


def test_eepa_resists_sliding_by_what_sticks():
    """Unloaded to zero force the contact still bears mu k_adh x^n sideways."""
    energy, ratio, mu = 0.05, 0.5, 0.5
    down = np.linspace(D, ratio ** (2 / 3) * D, 50)
    path = np.concatenate([[0.0, D], down, np.full(200, down[-1])])
    shear = np.concatenate([np.zeros(52), np.linspace(0, D, 200)])
    force = forces(EEPA, path, shear, mu=mu, plasticity=ratio, adhesion_energy=energy)
    k2 = K1 / (1 - ratio)
    least = 1.5 * math.pi * energy * math.sqrt(RADIUS * down[-1])
    sticks = least / (down[-1] ** 1.5 - least / k2) * down[-1] ** 1.5
    assert abs(force[-1, 0]) < 1e-9 * K1 * D**1.5
    assert force[-1, 1] == pytest.approx(-mu * sticks, rel=1e-9)
