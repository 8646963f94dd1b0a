"""From a run spec to a simulation: materials, laws, time step and grain sizes. Units become SI
here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dem.constants import DOWN
from dem.grains import sphere
from dem.grains.clump import random_turns, turned
from dem.grains.dumbbell import moments, sphere_radius
from dem.grains.sizes import clump_shape, rayleigh_of
from dem.linear import length
from dem.materials import PARTICLE, WALL, contact_parameters, laws_of, material_of
from dem.simulation import Air, Simulation, SkinPolicy
from dem.walls.builder import WallSet

if TYPE_CHECKING:
    from dem.spec import RunSpec  # which loads the experiments, and they this

FAR = -1e3  # height at which a wall that was taken away meets nothing [m]


def add_grains(
    sim: Simulation,
    spec: RunSpec,
    position: np.ndarray,
    radius: np.ndarray,
    velocity: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Add grains with the volume of spheres of `radius` (k,) [m]: these, or bonded pairs or clumps
    turned at random.

    position (k, 3) of the centres [m], velocity (k, 3) [m/s].
    """
    elongation, shape = spec.particles.elongation, clump_shape(spec)
    density = spec.materials.particle.density_kg_m3
    mass = sphere.mass(radius, density)
    if shape is not None and len(shape.radius) > 1:
        offset, inertia = turned(random_turns(len(radius), rng), shape)
        spheres = position[:, None] + radius[:, None, None] * offset
        inertia = (density * radius**5)[:, None, None] * inertia
        own = {"velocity": velocity, "mass": mass, "inertia": inertia, "centre": position}
        sim.add_clusters(spheres, radius[:, None] * shape.radius, **own)
    elif elongation != 1.0:
        a = sphere_radius(radius, elongation)
        axis = rng.normal(size=(len(a), 3))
        axis /= length(axis)[:, None]
        about, across = moments(a, elongation, density)
        along = axis[:, :, None] * axis[:, None, :]
        inertia = about[:, None, None] * along + across[:, None, None] * (np.eye(3) - along)
        half = ((elongation - 1.0) * a)[:, None] * axis
        spheres = np.stack([position - half, position + half], axis=1)
        own = {"velocity": velocity, "mass": mass, "inertia": inertia}
        sim.add_clusters(spheres, np.stack([a, a], axis=1), **own)
    else:
        sim.add_particles(position, radius, velocity=velocity)


def time_step_of(spec: RunSpec) -> float:
    """Time step [s]: as given, or the chosen fraction of the Rayleigh time of the smallest
    grain."""
    if spec.numerics.time_step_s is not None:
        return spec.numerics.time_step_s
    return spec.numerics.rayleigh_fraction * rayleigh_of(spec)


def build_simulation(spec: RunSpec, walls: WallSet, gravity: ArrayLike = DOWN) -> Simulation:
    """A `Simulation` with the spec's materials, laws and numerics, the given walls and no
    particles."""
    numerics, contacts = spec.numerics, contact_parameters(spec)
    pair = contacts[PARTICLE, PARTICLE]
    air = None if spec.laws.drag == "none" else Air(pair.air_density, pair.air_viscosity)  # type: ignore[attr-defined]  # a field for each law
    return Simulation(
        {PARTICLE: material_of(spec.materials.particle), WALL: material_of(spec.materials.wall)},
        contacts,
        laws=laws_of(spec),
        time_step=time_step_of(spec),
        gravity=gravity,
        precision=numerics.precision,
        walls=walls,
        air=air,
        overlap_limit=numerics.overlap_limit,
        skin=SkinPolicy(numerics.skin, numerics.skin_horizon),
    )


def take_away(sim: Simulation, name: str) -> None:
    """Remove a wall at once: far below, where no grain falls."""
    sim.wall_state.origin[sim.walls.index(name), 2] = FAR
    sim.move_wall(name)
