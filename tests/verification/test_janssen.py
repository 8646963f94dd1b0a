"""A column of grains in a tube: the floor's load saturates as Janssen says."""

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
from scipy.optimize import curve_fit

from dem.walls.builder import WallSet
from scenes import GRAVITY, ContactParameters, effective

DIAMETER = 4e-3
TUBE = 5 * DIAMETER  # radius
BATCHES = (250, 250, 500, 500, 750, 750, 1000)
"""Grains of each filling; 4000 stand five tube diameters high."""
PAIR = ContactParameters(0.5, 0.5)
WALL_FRICTION = (0.125, 0.25, 0.5)
DRAW = 0.02  # speed of the tube [m/s]
MOBILISE, WEIGH = 1.0 * DIAMETER, 2.0 * DIAMETER  # paths of the tube [m]
SAMPLES = 40
BINS = np.arange(0.0, 60.0, 2.0) * DIAMETER


class Column:
    """Tube and floor; the tube can be drawn up past the grains."""

    def __init__(self, wall_friction, seed):
        self.rng = np.random.default_rng(seed)
        walls = WallSet().body("floor", material="wall").plane((0, 0, 0), (0, 0, 1))
        walls.body("tube", material="wall").cylinder(TUBE, -30 * DIAMETER, 150 * DIAMETER)
        self.sim = make_sim(walls, PAIR, {"wall": ContactParameters(0.5, wall_friction)}, DIAMETER)

    def fill(self, count):
        """Pour `count` grains and wait until all rest."""
        top = self.sim.position[:, 2].max(initial=0.0)
        sites = sites_in_circle(TUBE, DIAMETER, self.rng)
        add_layers(self.sim, count, sites, top + DIAMETER, DIAMETER, self.rng)
        settle(self.sim)

    def weigh(self):
        """Draw the tube up; mean load on floor and tube [N] and on the tube's flank by height
        (bins,) [N]."""
        sim = self.sim
        sim.move_wall("tube", velocity=(0.0, 0.0, DRAW))
        advance_for(sim, MOBILISE / DRAW)
        start, before = sim.time, (sim.wall_impulse("floor")[2], sim.wall_impulse("tube")[2])
        pressed = np.zeros(len(BINS) - 1)
        for _ in range(SAMPLES):
            advance_for(sim, WEIGH / DRAW / SAMPLES)
            pressed += self.pressed() / SAMPLES
        after = (sim.wall_impulse("floor")[2], sim.wall_impulse("tube")[2])
        sim.move_wall("tube", velocity=(0.0, 0.0, 0.0))
        floor, tube = (-(b - a) / (sim.time - start) for a, b in zip(before, after, strict=True))
        return floor, tube, pressed

    def pressed(self):
        """Normal force of the grains on the tube by height (bins,) [N], from their overlaps by
        Hertz's law."""
        p, r = self.sim.position, self.sim.radius
        overlap = np.maximum(np.hypot(p[:, 0], p[:, 1]) + r - TUBE, 0.0)
        force = 4 / 3 * effective(GRAIN)[0] * np.sqrt(r) * overlap**1.5
        return np.histogram(p[:, 2], BINS, weights=force)[0]

    def weight_above(self):
        """Weight of the grains above the lower edge of each bin (bins,) [N]."""
        weight, _ = np.histogram(self.sim.position[:, 2], BINS, weights=self.sim.mass * GRAVITY)
        return weight[::-1].cumsum()[::-1]


def janssen(mass, saturation):
    """Mass that the floor feels of `mass` in the tube; all [kg]."""
    return saturation * (1 - np.exp(-mass / saturation))


def stresses(column, shear_ratio, pressed):
    """Vertical stress on the grains and radial stress on the tube by height [Pa], from the balance
    of forces."""
    width, area = BINS[1] - BINS[0], math.pi * TUBE**2
    carried = shear_ratio * pressed[::-1].cumsum()[::-1]
    # at the middle of each bin: half of its own weight and friction
    vertical = column.weight_above() - carried
    vertical = 0.5 * (vertical + np.append(vertical[1:], 0.0)) / area
    return vertical, pressed / (2 * math.pi * TUBE * width)


def measure(wall_friction, seed=1):
    """Fill and weigh; a dict of masses [kg], fitted saturation [kg] and what the forces on the tube
    say."""
    column, mass, floor = Column(wall_friction, seed), [], []
    for count in BATCHES:
        column.fill(count)
        down, up, pressed = column.weigh()
        mass.append(float(column.sim.mass.sum()))
        floor.append(down / GRAVITY)
    mass, floor = np.array(mass), np.array(floor)
    (saturation,), _ = curve_fit(janssen, mass, floor, p0=[mass.mean()])
    ratio = up / pressed.sum()
    vertical, radial = stresses(column, ratio, pressed)
    # the lowest grains lean on the floor and the top ones are few
    top = column.sim.position[:, 2].max()
    inner = (BINS[:-1] > 3 * DIAMETER) & (BINS[1:] < top - 3 * DIAMETER)
    k = float((vertical[inner] @ radial[inner]) / (vertical[inner] @ vertical[inner]))
    density = bulk_density(column.sim, TUBE, 5 * DIAMETER, top - 5 * DIAMETER)
    return {
        "mass": mass,
        "floor": floor,
        "saturation": float(saturation),
        "mobilised": ratio / wall_friction,
        "k": k,
        "from_wall": math.pi * density * (2 * TUBE) ** 3 / (16 * ratio * k),
        "balance": (down + up) / (mass[-1] * GRAVITY),
    }


@pytest.mark.long
@pytest.mark.slow
def test_the_floor_of_a_column_feels_what_janssen_says(record, figure):
    cases = {mu: measure(mu) for mu in WALL_FRICTION}
    draw(figure, cases)
    source = "Janssen (1895)"
    for mu, m in cases.items():
        name = f"mu_wall = {mu:g}"
        # the drawn column moves steadily: what the floor does not carry the tube does
        record(
            "Janssen", f"floor and tube over weight, {name}", m["balance"], 1.0, 0.01, "", "balance"
        )
        # the load of a drawn column of ten grains across fluctuates by some per cent
        residual = m["floor"] - janssen(m["mass"], m["saturation"])
        misfit = np.sqrt(np.mean(residual**2)) / m["saturation"]
        what = f"root mean square misfit over saturation, {name}"
        record("Janssen", what, misfit, 0.0, 0.06, "", source)
        # the stress is not uniform across the tube, as the law takes it to be
        what, close = f"saturated mass, fit against wall forces, {name}", 0.15 * m["from_wall"]
        record("Janssen", what, m["saturation"], m["from_wall"], close, "kg", source)
        record("Janssen", f"K, {name}", m["k"], None, None, "", "")
        record(
            "Janssen", f"share of the wall's friction, {name}", m["mobilised"], 1.0, None, "", ""
        )


def draw(figure, cases):
    _, ax = figure(
        "Janssen",
        "janssen",
        "Mass felt by the floor over mass in the tube: engine, Janssen's curve fitted, and "
        "Janssen's curve with the "
        "saturation that the forces on the tube give.",
    )
    x = np.linspace(0, max(m["mass"][-1] for m in cases.values()), 100)
    ax.plot(x, x, color="#8a8f98", linestyle=":", linewidth=1, label="hydrostatic")
    for (mu, m), colour in zip(cases.items(), ("#2f6db5", "#d1711f", "#2e8b57"), strict=True):
        ax.plot(m["mass"], m["floor"], "o", color=colour, label=f"mu_wall = {mu:g}")
        ax.plot(x, janssen(x, m["saturation"]), "-", color=colour)
        ax.plot(x, janssen(x, m["from_wall"]), "--", color=colour, linewidth=1)
    ax.set(xlabel="mass in the tube [kg]", ylabel="mass felt by the floor [kg]")
    ax.legend(fontsize=8)
