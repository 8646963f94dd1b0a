"""What a valid spec should still be warned about before it runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dem.constants import GRAVITY
from dem.contact.registry import DEFAULTS, pair_properties
from dem.contact.tangential.mindlin import SLIP
from dem.experiments import experiment_of
from dem.experiments.heap import PACKING
from dem.experiments.setup import time_step_of
from dem.grains import sphere
from dem.grains.sizes import smallest_radius
from dem.materials import PARTICLE, contact_parameters, laws_of, material_of
from dem.timescales import hertz_contact_time
from dem.units import question

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters, Laws, Material
    from dem.spec import RunSpec


def limits_of(spec: RunSpec) -> list[str]:
    """Sentences on what a calibration with the laws of a `RunSpec` does not hold for. The list is
    empty if they hold in motion too."""
    if spec.contacts.particle_particle.rolling_friction == 0.0:
        return []
    return [
        f"laws.{law.slot} {law.name} {law.holds_at_rest}: the result holds for heaps and beds at "
        "rest or sheared slowly, not for grains in a drum or mixer; there calibrate with a law on "
        "the relative spin and torsion"
        for law in laws_of(spec).chosen()
        if law.holds_at_rest
    ]


def warnings_of(spec: RunSpec) -> list[str]:
    """Sentences, each with the setting to change, about a valid `RunSpec`; an empty list when all
    is well."""
    experiment = experiment_of(spec)
    said = [*_doubtful(spec.model_dump(mode="json")), *experiment.advice(spec)]
    said += [*_short_contacts(experiment, spec), *_trembling(experiment, spec)]
    return [*said, *_creeping(spec), *_dragged(spec)]


def _doubtful(data, prefix=""):
    """A sentence for each number of a spec's mapping that no material or rig has."""
    found = []
    for key, value in data.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            found += _doubtful(value, f"{name}.")
        asked = (question(name, x) for x in (value if isinstance(value, list) else [value]))
        found += [f"{name}: {text}" for text in asked if text]
    return found


def _short_contacts(experiment, spec):
    """A time step that resolves the shortest contact too coarsely: its restitution comes out low.
    That is the smallest grain's on the wall: grains on grains are softer and lighter."""
    if experiment.impact_speed is None:
        return
    speed = experiment.impact_speed(spec)
    grain, wall = (material_of(m) for m in (spec.materials.particle, spec.materials.wall))
    steps = hertz_contact_time(smallest_radius(spec), speed, grain, wall) / time_step_of(spec)
    if steps < experiment.least_steps:
        yield (
            f"an impact at {speed:.2g} m/s lasts {steps:.1f} time steps; below "
            f"{experiment.least_steps} the restitution is not the one asked for: lower "
            "numerics.rayleigh_fraction"
        )


def _trembling(experiment, spec):
    """A time step at which the spin of grains grows that others press."""
    known = (DEFAULTS["normal"], DEFAULTS["tangential"])  # whose stiffness `pressed_step` has
    if not experiment.poured or (spec.laws.normal, spec.laws.tangential) != known:
        return
    pressure = pressure_of(spec)
    material = material_of(spec.materials.particle)
    contact = contact_parameters(spec)[PARTICLE, PARTICLE]
    longest = pressed_step(smallest_radius(spec), material, contact, pressure, laws_of(spec))
    share, given = longest / time_step_of(spec), spec.numerics.time_step_s
    fraction = math.floor(100.0 * share * spec.numerics.rayleigh_fraction) / 100.0
    lower = f"rayleigh_fraction to {fraction:g}"
    if given is not None:
        lower = f"time_step_s to {share * given:.2g}"
    if share < 1.0:
        yield (
            f"grains of restitution {contact.restitution:g} under {1e-3 * pressure:.2g} kPa may "
            f"tremble at this time step and come to rest late or never: lower numerics.{lower}"
        )


def _creeping(spec):
    """A rolling law without a spring, under which a grain that should rest creeps."""
    return [
        f"laws.{law.slot} {law.name} has no spring: below its onset a grain on a slope creeps (by "
        "some 1e-5 m/s), as the torque follows the spin; choose a law with a spring where grains "
        "must rest"
        for law in laws_of(spec).chosen()
        if law.creeps
    ]


def _dragged(spec):
    """Drag on grains of bonded spheres."""
    alone = spec.particles.clump is None and spec.particles.elongation == 1.0
    if spec.laws.drag != "none" and not alone:
        yield (
            f"laws.drag {spec.laws.drag} acts on each sphere of a grain as if it were alone: "
            "grains of several spheres fall too slowly; trust it for single spheres"
        )


def pressure_of(spec: RunSpec) -> float:
    """Pressure on the lowest grains [Pa]: of the bed, or of the lid."""
    particles, density = spec.particles, spec.materials.particle.density_kg_m3
    bed = bed_pressure(particles.count, 1e-3 * particles.diameter_mm, density)
    stresses = (v for k, v in spec.geometry if k.endswith("normal_stress_kPa"))
    return max(bed, *(1e3 * stress for stress in stresses if stress), 0.0)


def bed_pressure(count: int, diameter: float, density: float) -> float:
    """Pressure [Pa] under a bed as deep as the cube that the grains fill; diameter [m], density of
    the grain [kg/m3]."""
    depth = (count * math.pi / 6.0 / PACKING) ** (1.0 / 3.0) * diameter
    return PACKING * density * GRAVITY * depth


def pressed_step(
    radius: float, material: Material, contact: ContactParameters, pressure: float, laws: Laws
) -> float:
    """Longest time step [s] at which the spin of grains under a pressure [Pa] dies out.

    radius [m]; material: `Material`; contact: `ContactParameters` of two grains; laws: `Laws`. In a
    square lattice of grains that all spin alike each turns against four others: W^2 = 20 k_t/m and
    C = 20 c/m, with Mindlin's spring k_t = 8 G* a and its dashpot c = c_t/(1 + 7 c_t dt/m)
    (`dem.contact.tangential.mindlin.settled`, m* = m/2). The velocity is half a step behind the
    position, so the spin dies out while (W dt)^2 + 2 C dt < 4. A contact bears the pressure on the
    square about a grain, by Hertz.
    """
    p = pair_properties(laws, material, material, contact)
    mass = sphere.mass(radius, material.density)
    force = pressure * (2.0 * radius) ** 2
    stiffness = 8.0 * p.shear * (0.375 * force * radius / p.young) ** (1.0 / 3.0)
    square = 20.0 * stiffness / mass
    dashpot = p.damping * math.sqrt(0.5 * stiffness / mass)
    behind = 2.0 * SLIP * dashpot
    # (square dt^2 - 4) (1 + behind dt) + 40 dashpot dt = 0, which has one root above 0
    cubic = [square * behind, square, 40.0 * dashpot - 4.0 * behind, -4.0]
    return float(np.roots(cubic).real.max())
