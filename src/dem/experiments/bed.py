"""Beds of grains for the experiments: filled in layers, thrown about, at rest. All in SI."""

import math

import numpy as np

from dem.constants import GRAVITY
from dem.experiments.setup import add_grains
from dem.grains import fall_time
from dem.linear import slope

SHAKE = 3.0  # speed of the grains when they are made, of sqrt(g reach): it breaks the lattice
PITCH = 2.15  # between grains when they are made, in reaches
LOOK = 1.0  # between looks at the energy, in fall times of the mean grain


def shake(reach):
    """Greatest speed [m/s] along an axis of new grains of half length `reach` [m]."""
    return SHAKE * math.sqrt(GRAVITY * reach)


def look(spec):
    """Time [s] between two looks at the grains."""
    return LOOK * fall_time(spec)


def sites_in_circle(radius, reach, rng):
    """Places (k, 2) within a circle where grains of half length `reach` do not touch, in random
    order."""
    line = np.arange(-radius + reach, radius, PITCH * reach)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    inside = np.hypot(x, y) < radius - 1.05 * reach
    return rng.permutation(np.column_stack([x[inside], y[inside]]))


def sites_in_rectangle(low, high, reach, rng):
    """The same within low..high, both (2,)."""
    lines = [
        np.arange(a + 1.05 * reach, b - 1.04 * reach, PITCH * reach)
        for a, b in zip(low, high, strict=True)
    ]
    x, y = (v.ravel() for v in np.meshgrid(*lines, indexing="ij"))
    return rng.permutation(np.column_stack([x, y]))


def fill(sim, spec, radii, sites, bottom, reach, rng, order=(0, 1, 2)):
    """Make grains of `radii` (n,) at the sites, layer on layer above `bottom`, and throw them
    about.

    order: axes of space that the sites' two and the height are.
    """
    layer, place = np.divmod(np.arange(len(radii)), len(sites))
    height = bottom + (1.1 + PITCH * layer) * reach
    along = np.column_stack([sites[place], height])
    position = np.empty_like(along)
    position[:, list(order)] = along
    speed = shake(reach)
    velocity = rng.uniform(-speed, speed, position.shape)
    add_grains(sim, spec, position, radii, velocity, rng)


def highest_site(count, sites, bottom, reach):
    """Height above which no grain of `fill` reaches, however it was thrown."""
    hop = shake(reach) ** 2 / (2.0 * GRAVITY)
    return bottom + (2.2 + PITCH * ((count - 1) // len(sites))) * reach + 1.5 * hop


def advance_for(sim, duration):
    """Advance by about `duration`, one step at least."""
    sim.advance(max(round(duration / sim.time_step), 1))


def motion(sim):
    """Energy of motion, spins left out, over what lifts every grain by its radius [-]: loose grains
    may spin on."""
    mass, velocity = sim.mass, sim.velocity
    energy = 0.5 * float((mass * (velocity * velocity).sum(1)).sum())
    return energy / (GRAVITY * float((mass * sim.radius).sum()))


def settle(sim, spec, limit, threshold=1e-4):
    """Wait until the grains rest, `limit` seconds at most; True when they do."""
    start, pause = sim.time, look(spec)
    while sim.time - start < limit:
        advance_for(sim, pause)
        if sim.time - start > 5.0 * pause and motion(sim) < threshold:
            return True
    return False


def _ball(across):
    """Middles (p, 3) of the cells of a lattice, so many across, inside the unit sphere."""
    line = (2.0 * np.arange(across) + 1.0) / across - 1.0
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[(points * points).sum(1) < 1.0]


BALL = _ball(8)


def solid_fraction(position, radius, cube, core, low, high):
    """Share of the volume of a core, a cylinder of radius `core` about z between two heights, that
    grains fill; cube (n,): `Simulation.cubed_radius`.

    A sphere that crosses the border counts by its part inside: grains lie in layers at walls, and
    whole grains would count a layer more or less.
    """
    out = np.hypot(position[:, 0], position[:, 1])
    depth = np.minimum(core - out, np.minimum(position[:, 2] - low, high - position[:, 2]))
    share = (depth >= radius).astype(float)
    cut = np.abs(depth) < radius
    x, y, z = np.moveaxis(position[cut][:, None] + radius[cut][:, None, None] * BALL, -1, 0)
    share[cut] = ((np.hypot(x, y) < core) & (z > low) & (z < high)).mean(1)
    volume = 4.0 / 3.0 * math.pi * float((share * cube).sum())
    return volume / (math.pi * core**2 * (high - low))


def surface_profile(along, height, radius, low, high, bins):
    """Middles (bins,) of strips of low..high, and the highest top of a grain in each; nan where
    there is none."""
    edges = np.linspace(low, high, bins + 1)
    strip = np.digitize(along, edges) - 1
    top = np.full(bins, np.nan)
    for k in range(bins):
        own = strip == k
        if own.any():
            top[k] = (height[own] + radius[own]).max()
    return 0.5 * (edges[1:] + edges[:-1]), top


def profile_angle(along, top):
    """Slope [deg] of the line through a profile, nan left out; nan with fewer than three points."""
    good = np.isfinite(top)
    if good.sum() < 3:
        return math.nan
    return math.degrees(math.atan(slope(along[good], top[good])))
