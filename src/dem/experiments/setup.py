"""From a run spec to a simulation: materials, laws, time step and grain sizes. Units become SI here."""

import math

import numpy as np

from dem.contact.damping.plastic import yield_pressure
from dem.contact.registry import ContactParameters, Laws, Material
from dem.dumbbell import moments, sphere_radius
from dem.grains import mean_radius, smallest_radius
from dem.linear import length
from dem.simulation import Air, Simulation, SkinPolicy
from dem.timescales import rayleigh_time

PARTICLE, WALL = "particle", "wall"


def material_of(entry):
    """`Material` from a spec's material."""
    return Material(entry.density_kg_m3, entry.shear_modulus_Pa, entry.poisson_ratio)


def laws_of(spec):
    """`Laws` from a spec."""
    chosen = spec.laws
    return Laws(
        chosen.damping,
        chosen.friction,
        chosen.rolling,
        chosen.cohesion,
        chosen.torsion,
        chosen.drag,
    )


def add_grains(sim, spec, position, radius, velocity, rng):
    """Add grains with the volume of spheres of `radius` (k,) [m]: these, or bonded pairs turned at random.

    position (k, 3) of the centres [m], velocity (k, 3) [m/s].
    """
    elongation = spec.particles.elongation
    if elongation == 1.0:
        sim.add_particles(position, radius, velocity=velocity)
        return
    density = spec.materials.particle.density_kg_m3
    mass = 4.0 / 3.0 * math.pi * radius**3 * density
    a = sphere_radius(radius, elongation)
    axis = rng.normal(size=(len(a), 3))
    axis /= length(axis)[:, None]
    about, across = moments(a, elongation, density)
    along = axis[:, :, None] * axis[:, None, :]
    inertia = about[:, None, None] * along + across[:, None, None] * (np.eye(3) - along)
    half = ((elongation - 1.0) * a)[:, None] * axis
    sim.add_clusters(
        np.stack([position - half, position + half], axis=1),
        np.stack([a, a], axis=1),
        velocity=velocity,
        mass=mass,
        inertia=inertia,
    )


def time_step_of(spec):
    """Time step [s]: as given, or the chosen fraction of the Rayleigh time of the smallest grain."""
    if spec.numerics.time_step_s is not None:
        return spec.numerics.time_step_s
    m = spec.materials.particle
    rayleigh = rayleigh_time(
        smallest_radius(spec), m.density_kg_m3, m.shear_modulus_Pa, m.poisson_ratio
    )
    return spec.numerics.rayleigh_fraction * rayleigh


def _or(value, default):
    return default if value is None else value


def contact_parameters(spec):
    """{pair of materials: ContactParameters}; each law's constants are given for grain on grain and grain on wall."""
    q = spec.law_parameters
    shared = {
        "surface_tension": _or(q.surface_tension_N_m, 0.0),
        "contact_angle": math.radians(_or(q.contact_angle_deg, 0.0)),
        "viscous_time": _or(q.viscoelastic_time_s, 0.0),
        "friction_exponent": _or(q.friction_exponent, 0.0),
        "friction_reference": _or(q.friction_reference_force_N, 1.0),
        "rolling_stiffness": _or(q.rolling_stiffness_factor, 2.25),
        "rolling_damping": _or(q.rolling_damping_ratio, 0.3),
    }
    if spec.laws.damping == "plastic":
        grain = material_of(spec.materials.particle)
        shared["yield_pressure"] = yield_pressure(q.yield_velocity_m_s, grain, mean_radius(spec))
    out = {}
    for name in (PARTICLE, WALL):
        c = spec.contacts.particle_particle if name == PARTICLE else spec.contacts.particle_wall
        prefix = "" if name == PARTICLE else "wall_"
        extra = {
            "cohesion_energy_density": _or(
                getattr(q, prefix + "cohesion_energy_density_J_m3"), 0.0
            ),
            "surface_energy": _or(getattr(q, prefix + "surface_energy_J_m2"), 0.0),
            "liquid_volume_fraction": _or(getattr(q, prefix + "liquid_volume_fraction"), 0.0),
        }
        out[PARTICLE, name] = ContactParameters(
            c.restitution, c.static_friction, c.rolling_friction, **shared, **extra
        )
    return out


def build_simulation(spec, walls, gravity=(0.0, 0.0, -9.81)):
    """A `Simulation` with the spec's materials, laws and numerics, the given walls and no particles."""
    q, numerics = spec.law_parameters, spec.numerics
    air = None
    if spec.laws.drag != "none":
        air = Air(_or(q.air_density_kg_m3, Air.density), _or(q.air_viscosity_Pa_s, Air.viscosity))
    return Simulation(
        {PARTICLE: material_of(spec.materials.particle), WALL: material_of(spec.materials.wall)},
        contact_parameters(spec),
        laws=laws_of(spec),
        time_step=time_step_of(spec),
        gravity=gravity,
        precision=numerics.precision,
        walls=walls,
        air=air,
        overlap_limit=numerics.overlap_limit,
        skin=SkinPolicy(numerics.skin, numerics.skin_horizon),
    )


def rest_energy(sim, gravity=9.81):
    """Kinetic energy in units of the energy that lifts every grain by its radius [-]."""
    radius, mass = sim.radius, sim.mass
    return sim.kinetic_energy() / max(float((mass * radius).sum()) * gravity, 1e-300)
