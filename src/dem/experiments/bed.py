"""Beds of grains for the experiments: filled in layers, thrown about, and read. All in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dem.constants import GRAVITY
from dem.experiments.phases import rest
from dem.experiments.setup import add_grains, build_simulation
from dem.grains.sizes import draw_radii, fall_time, largest_reach
from dem.linear import slope
from dem.simulation import Simulation
from dem.walls.builder import WallSet

if TYPE_CHECKING:
    from dem.spec import RunSpec  # which loads the experiments, and they this

SHAKE = 3.0  # speed of the grains when they are made, of sqrt(g reach): it breaks the lattice
PITCH = 2.15  # between grains when they are made, in reaches


def shake(reach: float) -> float:
    """Greatest speed [m/s] along an axis of new grains of half length `reach` [m]."""
    return SHAKE * math.sqrt(GRAVITY * reach)


def sites_in_circle(radius: float, reach: float, rng: np.random.Generator) -> np.ndarray:
    """Places (k, 2) within a circle where grains of half length `reach` do not touch, in random
    order."""
    line = np.arange(-radius + reach, radius, PITCH * reach)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    inside = np.hypot(x, y) < radius - 1.05 * reach
    return rng.permutation(np.column_stack([x[inside], y[inside]]))


def sites_in_rectangle(
    low: Sequence[float], high: Sequence[float], reach: float, rng: np.random.Generator
) -> np.ndarray:
    """The same within low..high, both (2,)."""
    (left, front), (right, back), pitch = low, high, PITCH * reach
    across = np.arange(left + 1.05 * reach, right - 1.04 * reach, pitch)
    deep = np.arange(front + 1.05 * reach, back - 1.04 * reach, pitch)
    x, y = (v.ravel() for v in np.meshgrid(across, deep, indexing="ij"))
    return rng.permutation(np.column_stack([x, y]))


def fill(
    sim: Simulation,
    spec: RunSpec,
    radii: np.ndarray,
    sites: np.ndarray,
    bottom: float,
    reach: float,
    rng: np.random.Generator,
    order: tuple[int, int, int] = (0, 1, 2),
) -> None:
    """Make grains of `radii` (n,) at the sites, layer on layer above `bottom`, and throw them
    about.

    order: axes of space that the sites' two and the height are.
    """
    layer, place = np.divmod(np.arange(len(radii)), len(sites))
    height = bottom + (1.1 + PITCH * layer) * reach
    position = np.empty((len(radii), 3))
    position[:, list(order)] = np.column_stack([sites[place], height])
    speed = shake(reach)
    velocity = rng.uniform(-speed, speed, position.shape)
    add_grains(sim, spec, position, radii, velocity, rng)


def highest_site(count: int, sites: np.ndarray, bottom: float, reach: float) -> float:
    """Height [m] above which no grain of `fill` reaches, however it was thrown; sites (k, 2),
    bottom and reach [m]."""
    hop = shake(reach) ** 2 / (2.0 * GRAVITY)
    return bottom + (2.2 + PITCH * ((count - 1) // len(sites))) * reach + 1.5 * hop


def poured(
    spec: RunSpec,
    walls: Callable[[float], WallSet],
    inside: float | tuple[float, float],
    floor: float,
    rng: np.random.Generator,
) -> Simulation:
    """Simulation of the spec's grains, which were poured above `floor` [m] and rest.

    walls: height of the highest site [m] -> WallSet; inside: radius of the circle that a layer
    fills, or half the sides of the rectangle (2,) [m]. Raises RefusedStateError where the grains do
    not rest.
    """
    reach, radii = largest_reach(spec), draw_radii(spec, spec.particles.count, rng)
    if isinstance(inside, tuple):
        sites = sites_in_rectangle([-half for half in inside], inside, reach, rng)
    else:
        sites = sites_in_circle(inside, reach, rng)
    sim = build_simulation(spec, walls(highest_site(len(radii), sites, floor, reach)))
    fill(sim, spec, radii, sites, floor, reach, rng)
    rest(sim, spec, spec.numerics.max_time_s, "filling")
    return sim


def advance_for(sim: Simulation, duration: float) -> None:
    """Advance by about `duration`, one step at least."""
    sim.advance(max(round(duration / sim.time_step), 1))


def force_on(sim: Simulation, name: str, duration: float) -> np.ndarray:
    """Mean force (3,) [N] of the grains on a wall over about `duration` [s] from now on."""
    start, before = sim.time, sim.wall_impulse(name)
    advance_for(sim, duration)
    return (sim.wall_impulse(name) - before) / (sim.time - start)


def lay_lid(sim: Simulation, spec: RunSpec, height: float) -> float:
    """Put the free wall `lid` at a height [m], as heavy as the grains; returns that mass [kg]. It
    follows the grains but does not bounce on them."""
    lid, walls, grains = sim.walls.index("lid"), sim.wall_state, float(sim.mass.sum())
    walls.origin[lid, 2], walls.mass[lid] = height, grains
    walls.drag[lid] = grains / fall_time(spec)
    return grains


_LINE = (2.0 * np.arange(8) + 1.0) / 8 - 1.0
_CUBE = np.stack(np.meshgrid(_LINE, _LINE, _LINE, indexing="ij"), axis=-1).reshape(-1, 3)
BALL = _CUBE[(_CUBE * _CUBE).sum(1) < 1.0]
"""Middles (p, 3) of the cells of a lattice, eight across, inside the unit sphere."""


def solid_fraction(
    position: np.ndarray, radius: np.ndarray, cube: np.ndarray, core: float, low: float, high: float
) -> float:
    """Share of the volume of a core, a cylinder of radius `core` about z between two heights, that
    grains fill; cube (n,): `Simulation.cubed_radius`.

    A sphere that crosses the border counts by its part inside: grains lie in layers at walls, and
    whole grains would count a layer more or less. position (n, 3), radius (n,) and the core's
    measures [m].
    """
    out = np.hypot(position[:, 0], position[:, 1])
    depth = np.minimum(core - out, np.minimum(position[:, 2] - low, high - position[:, 2]))
    share = (depth >= radius).astype(float)
    cut = np.abs(depth) < radius
    x, y, z = np.moveaxis(position[cut][:, None] + radius[cut][:, None, None] * BALL, -1, 0)
    share[cut] = ((np.hypot(x, y) < core) & (z > low) & (z < high)).mean(1)
    volume = 4.0 / 3.0 * math.pi * float((share * cube).sum())
    return volume / (math.pi * core**2 * (high - low))


def surface_profile(
    along: np.ndarray, height: np.ndarray, radius: np.ndarray, low: float, high: float, bins: int
) -> tuple[np.ndarray, np.ndarray]:
    """Middles (bins,) of strips of low..high, and the highest top of a grain in each; nan where
    there is none. along, height and radius (n,) of the grains [m]."""
    edges = np.linspace(low, high, bins + 1)
    strip = np.digitize(along, edges) - 1
    top = np.full(bins, np.nan)
    for k in np.intersect1d(strip, np.arange(bins)):
        top[k] = (height + radius)[strip == k].max()
    return 0.5 * (edges[1:] + edges[:-1]), top


def profile_angle(along: np.ndarray, top: np.ndarray) -> float:
    """Slope [deg] of the line through a profile, nan left out; nan with fewer than three points.
    along, top (m,) [m]."""
    good = np.isfinite(top)
    if good.sum() < 3:
        return math.nan
    return math.degrees(math.atan(slope(along[good], top[good])))
