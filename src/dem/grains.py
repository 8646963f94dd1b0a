"""The sizes of a run spec's grains, in SI unless the name says otherwise."""

import numpy as np

from dem.dumbbell import sphere_radius


def number_fractions(sizes):
    """Share of each size by number; fractions by mass are divided by d^3."""
    share = np.array(sizes.fractions, float)
    if sizes.by == "mass":
        share = share / np.array(sizes.diameters_mm) ** 3
    return share / share.sum()


def mean_radius(spec):
    """Radius [m] of the mean grain: by number of the size distribution, after the scale factor."""
    sizes = spec.particles.sizes
    scale = 0.5e-3 * spec.particles.scale_factor
    if sizes is None:
        return scale * spec.particles.diameter_mm
    diameter, share = np.array(sizes.diameters_mm), number_fractions(sizes)
    return scale * float((diameter * share).sum())


def draw_radii(spec, count, rng):
    """(count,) radii [m]; a size distribution is met as exactly as whole grains allow, in random order."""
    p = spec.particles
    if p.sizes is None:
        return np.full(count, 0.5e-3 * p.diameter_mm * p.scale_factor)
    exact = number_fractions(p.sizes) * count
    number = np.floor(exact).astype(int)
    number[np.argsort(number - exact, kind="stable")[: count - number.sum()]] += 1
    radii = 0.5e-3 * p.scale_factor * np.repeat(np.array(p.sizes.diameters_mm), number)
    return rng.permutation(radii)


def smallest_radius(spec):
    """Radius [m] of the smallest sphere that a grain is or is made of."""
    p = spec.particles
    d = p.diameter_mm if p.sizes is None else min(p.sizes.diameters_mm)
    return sphere_radius(0.5e-3 * d * p.scale_factor, p.elongation)


def largest_reach(spec):
    """Half the length [m] of the largest grain, its radius where grains are spheres."""
    p = spec.particles
    d = p.diameter_mm if p.sizes is None else max(p.sizes.diameters_mm)
    return p.elongation * sphere_radius(0.5e-3 * d * p.scale_factor, p.elongation)


def longest_mm(spec):
    """Length [mm] of the largest grain."""
    return 2e3 * largest_reach(spec)


def grain_volume(spec):
    """Mean volume [m3] of a grain, by number."""
    p = spec.particles
    if p.sizes is None:
        cube = p.diameter_mm**3
    else:
        cube = float((number_fractions(p.sizes) * np.array(p.sizes.diameters_mm) ** 3).sum())
    return np.pi / 6.0 * 1e-9 * p.scale_factor**3 * cube


def grain_mass(spec):
    """Mean mass [kg] of a grain, by number."""
    return spec.materials.particle.density_kg_m3 * grain_volume(spec)
