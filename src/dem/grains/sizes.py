"""The sizes of a run spec's grains, in SI unless the name says otherwise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dem.constants import GRAVITY
from dem.grains.clump import shape_of
from dem.grains.dumbbell import sphere_radius
from dem.timescales import rayleigh_time

if TYPE_CHECKING:
    from dem.grains.clump import Shape
    from dem.spec import Clump, RunSpec, Sizes


def rayleigh_of(spec: RunSpec) -> float:
    """Rayleigh time of the smallest grain [s]."""
    m = spec.materials.particle
    return rayleigh_time(
        smallest_radius(spec), m.density_kg_m3, m.shear_modulus_Pa, m.poisson_ratio
    )


def classes(sizes: Sizes) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest diameter (k,) [mm] of each class; the same of a class that is one size."""
    low = np.array(sizes.diameters_mm, float)
    return low, low if sizes.upper_diameters_mm is None else np.array(sizes.upper_diameters_mm)


def _mean_power(sizes, power):
    """Mean (k,) of d^power [mm] over the grains of each class, by number.

    What the fractions are shares of is even over a class's diameters: by mass its grains go as
    d^-3, by number evenly."""
    a, b = classes(sizes)
    own = -3 if sizes.by == "mass" else 0

    def integral(n):
        whole = np.log(b / a) if n == -1 else (b ** (n + 1.0) - a ** (n + 1.0)) / (n + 1.0)
        return np.where(b > a, whole, a ** float(n))

    return integral(own + power) / integral(own)


def number_fractions(sizes: Sizes) -> np.ndarray:
    """Share of each class by number; fractions by mass are divided by the mean cube of the
    class."""
    share = np.array(sizes.fractions, float)
    if sizes.by == "mass":
        share = share / _mean_power(sizes, 3)
    return share / share.sum()


def mean_radius(spec: RunSpec) -> float:
    """Radius [m] of the mean grain: by number of the size distribution, after the scale factor."""
    sizes = spec.particles.sizes
    scale = 0.5e-3 * spec.particles.scale_factor
    if sizes is None:
        return scale * spec.particles.diameter_mm
    return scale * float((_mean_power(sizes, 1) * number_fractions(sizes)).sum())


def fall_time(spec: RunSpec) -> float:
    """sqrt(r / g) [s] of the mean grain, in which it falls by half its radius. The unit of an
    experiment's own times: grains and rig enlarged alike then give the same."""
    return math.sqrt(mean_radius(spec) / GRAVITY)


def draw_radii(spec: RunSpec, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count,) radii [m]; a size distribution is met as exactly as whole grains allow, in random
    order."""
    p = spec.particles
    if p.sizes is None:
        return np.full(count, 0.5e-3 * p.diameter_mm * p.scale_factor)
    exact = number_fractions(p.sizes) * count
    number = np.floor(exact).astype(int)
    number[np.argsort(number - exact, kind="stable")[: count - number.sum()]] += 1
    diameters = np.concatenate(
        [_spread(a, b, n, p.sizes.by) for a, b, n in zip(*classes(p.sizes), number, strict=True)]
    )
    return rng.permutation(0.5e-3 * p.scale_factor * diameters)


def _spread(low, high, count, by):
    """`count` diameters of a class, at the middles of as many equal shares of its grains."""
    if high == low:
        return np.full(count, low)
    share = (np.arange(count) + 0.5) / max(count, 1)
    if by == "number":
        return low + share * (high - low)
    return 1.0 / np.sqrt(low**-2.0 + share * (high**-2.0 - low**-2.0))


def spheres_in(clump: Clump) -> tuple[tuple[float, float, float, float], ...]:
    """((x, y, z, radius), ...) of a spec's clump [mm]."""
    return tuple(zip(clump.x_mm, clump.y_mm, clump.z_mm, clump.radius_mm, strict=True))


def clump_shape(spec: RunSpec) -> Shape | None:
    """`dem.grains.clump.Shape` of the grains; None where they are spheres or pairs."""
    clump = spec.particles.clump
    return None if clump is None else shape_of(spheres_in(clump))


def smallest_radius(spec: RunSpec) -> float:
    """Radius [m] of the smallest sphere that a grain is or is made of."""
    p, shape = spec.particles, clump_shape(spec)
    d = p.diameter_mm if p.sizes is None else min(p.sizes.diameters_mm)
    radius = 0.5e-3 * d * p.scale_factor
    return sphere_radius(radius, p.elongation) if shape is None else shape.smallest * radius


def largest_reach(spec: RunSpec) -> float:
    """Half the length [m] of the largest grain, its radius where grains are spheres; of a clump the
    distance of its furthest point from its centre."""
    p, shape = spec.particles, clump_shape(spec)
    d = p.diameter_mm if p.sizes is None else float(classes(p.sizes)[1].max())
    radius = 0.5e-3 * d * p.scale_factor
    if shape is not None:
        return shape.reach * radius
    return p.elongation * sphere_radius(radius, p.elongation)


def longest_mm(spec: RunSpec) -> float:
    """Length [mm] of the largest grain."""
    return 2e3 * largest_reach(spec)


def grain_volume(spec: RunSpec) -> float:
    """Mean volume [m3] of a grain, by number."""
    p = spec.particles
    if p.sizes is None:
        cube = p.diameter_mm**3
    else:
        cube = float((number_fractions(p.sizes) * _mean_power(p.sizes, 3)).sum())
    return np.pi / 6.0 * 1e-9 * p.scale_factor**3 * cube
