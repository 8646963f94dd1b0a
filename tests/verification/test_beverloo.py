"""Discharge of a flat-bottomed silo: Beverloo's law W = C rho_b sqrt(g) (D - k d)^(5/2)."""

import math

import numpy as np
import pytest
from bulk import (
    GRAIN,
    add_layers,
    advance_for,
    bulk_density,
    make_sim,
    settle,
    sites_in_circle,
)

from dem.walls.builder import WallSet
from scenes import GRAVITY, ContactParameters

DIAMETER = 4e-3
SILO = 12 * DIAMETER  # radius
GRAINS = 10000  # stand 20 grains high, twice the widest orifice
GLASS = ContactParameters(
    0.97, 0.092
)  # beads of 3 mm, Foerster et al. (1994), Physics of Fluids 6:1108
ROUGH = ContactParameters(0.5, 0.4)
# in grains; the silo is 2.4 times the widest
ORIFICES = {"glass": (5.0, 6.0, 7.0, 8.5, 10.0), "rough": (5.0, 7.0, 10.0)}
K = 1.4
INTERVAL, TRANSIENT, WINDOW = 0.02, 0.2, 0.5  # [s]


def silo(orifice):
    """Walls with a circular orifice of this diameter [m] in the floor, or none."""
    walls = WallSet().body("silo", material="wall").cylinder(SILO, 0.0, 100 * DIAMETER)
    return walls.body("floor", material="wall").revolved(0.5 * orifice, 0.0, SILO, 0.0)


def fill(contact, rng):
    """Grains at rest on a closed floor: position (n, 3), radius (n,) [m], and the bulk density
    [kg/m3]."""
    sim = make_sim(silo(0.0), contact, {"wall": contact}, DIAMETER)
    add_layers(sim, GRAINS, sites_in_circle(SILO, DIAMETER, rng), 0.0, DIAMETER, rng)
    settle(sim)
    density = bulk_density(sim, SILO - 3 * DIAMETER, 3 * DIAMETER, 15 * DIAMETER)
    return sim.position, sim.radius, density


def put_back(sim, height, rng):
    """Move the grains that have left through the floor to above the bed; returns their mass
    [kg]."""
    out = sim.position[:, 2] < -2 * DIAMETER
    radius, mass = sim.radius[out], float(sim.mass[out].sum())
    if not out.any():
        return 0.0
    sim.remove(sim.tag[out])
    place = sites_in_circle(SILO, DIAMETER, rng)[: len(radius)]
    assert len(place) == len(radius), "more grains have left than fit into one layer"
    position = np.column_stack([place, np.full(len(radius), height)])
    # fast enough to make room for the next layer
    sim.add_particles(
        position, radius, velocity=[[0.0, 0.0, -1.3 * DIAMETER / INTERVAL]] * len(radius)
    )
    return mass


def discharge(contact, position, radius, orifice, rng):
    """Times [s] and mass that has left by then [kg], from the opening of the orifice [m] on."""
    sim = make_sim(silo(orifice), contact, {"wall": contact}, DIAMETER)
    sim.add_particles(position, radius)
    # well above the bed: single grains bounce on it
    height, times, masses = position[:, 2].max() + 10 * DIAMETER, [0.0], [0.0]
    while sim.time < TRANSIENT + WINDOW:
        advance_for(sim, INTERVAL)
        times.append(sim.time)
        masses.append(masses[-1] + put_back(sim, height, rng))
    return np.array(times), np.array(masses)


def measure(contact, orifices, seed=1):
    """Fill a silo and drain it through each of the orifices (m,) [m]; a dict of the runs, the
    steady flows (m,) [kg/s] and the bulk density [kg/m3]."""
    rng = np.random.default_rng(seed)
    position, radius, density = fill(contact, rng)
    runs = [discharge(contact, position, radius, d, rng) for d in orifices]
    flow = np.array([np.polyfit(t[t > TRANSIENT], m[t > TRANSIENT], 1)[0] for t, m in runs])
    return {"orifice": orifices, "runs": runs, "flow": flow, "density": density}


def constants(case):
    """C and k of Beverloo's law with the exponent 5/2: W^(2/5) is a straight line in D, zero at k
    d."""
    rise, offset = np.polyfit(case["orifice"], case["flow"] ** 0.4, 1)
    return rise**2.5 / (case["density"] * math.sqrt(GRAVITY)), -offset / rise / DIAMETER


@pytest.mark.long
@pytest.mark.slow
def test_the_discharge_grows_with_the_orifice_as_beverloo_says(record, figure):
    contacts = {"glass": GLASS, "rough": ROUGH}
    cases = {
        name: measure(contact, np.array(ORIFICES[name]) * DIAMETER)
        for name, contact in contacts.items()
    }
    draw(figure, cases)
    source = "Beverloo et al. (1961)"
    for name, case in cases.items():
        what = f"{name}, mu = {contacts[name].static_friction}"
        free = np.log(case["orifice"] - K * DIAMETER)
        exponent = np.polyfit(free, np.log(case["flow"]), 1)[0]
        c, k = constants(case)
        # k of 1.4 +- 0.2 moves the slope by 0.1; counting some hundred grains adds 0.03
        record("Beverloo", f"exponent of D - {K} d, {what}", exponent, 2.5, 0.15, "", source)
        # the published range is of smooth and round grains; friction lowers C
        tolerance = 0.05 if name == "glass" else None
        record("Beverloo", f"C, {what}", c, 0.60, tolerance, "", "published 0.55 to 0.65")
        record("Beverloo", f"k, {what}", k, K, 0.4, "", source)
        record(
            "Beverloo",
            f"packing of the bed, {what}",
            case["density"] / GRAIN.density,
            None,
            None,
            "",
            "",
        )


def draw(figure, cases):
    _, (left, right) = figure(
        "Beverloo",
        "beverloo",
        "Left: mass of glass that has left each orifice; grey: not used. Right: mean flow; points: "
        "engine, "
        "lines: Beverloo's law with the exponent 5/2, C and k fitted.",
        columns=2,
    )
    glass = cases["glass"]
    for (t, m), d in zip(glass["runs"], glass["orifice"], strict=True):
        left.plot(t, m, label=f"D = {d / DIAMETER:g} d")
    left.axvspan(0, TRANSIENT, color="#8a8f98", alpha=0.15, linewidth=0)
    left.set(xlabel="time [s]", ylabel="mass out [kg]")
    left.legend(fontsize=8)
    x = np.linspace(4.5, 10.5, 50) * DIAMETER
    for (name, case), colour in zip(cases.items(), ("#2f6db5", "#d1711f"), strict=True):
        c, k = constants(case)
        law = c * case["density"] * math.sqrt(GRAVITY) * (x - k * DIAMETER) ** 2.5
        right.plot(x / DIAMETER, law, "-", color=colour)
        right.plot(case["orifice"] / DIAMETER, case["flow"], "o", color=colour, label=name)
    right.set(xlabel="orifice over grain diameter", ylabel="flow [kg/s]")
    right.legend(fontsize=8)
