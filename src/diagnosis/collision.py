"""A drop or a slide as what it is: one contact, integrated by the engine with the laws of a run
spec.

The fall and the rise are free flights, so only the contact is stepped through, for grains of one
size at many speeds at once. The same engine, laws and time step as in a run of the experiment:
nothing is trained and nothing interpolated."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from calibration.errors import CalibrationError
from dem.constants import DOWN, GRAVITY
from dem.errors import BlowUpError
from dem.experiments.setup import build_simulation
from dem.grains.sizes import mean_radius
from dem.kernel.drag import apply_drag
from dem.kernel.state import new_particles
from dem.materials import WALL, material_of
from dem.simulation import Air
from dem.spec import RunSpec, parse_spec
from dem.timescales import hertz_contact_time
from dem.walls.builder import WallSet

STEP = {"rayleigh_fraction": 0.01, "precision": "double"}
COARSE = {"rayleigh_fraction": 0.2, "precision": "double"}
"""Of a bounce, whose restitution must be resolved; of a slide, which asks for the force at rest
only."""

LONGEST = 12.0  # elastic contact times after which a grain that has not left counts as stuck
FLIGHT_STEPS = 60
SETTLE, SLIP_SPEED, LOOK, LOOKS = 20.0, 0.2, 5, 400
"""A slide: contact times to come to rest, speed of the push [m/s], steps between looks at the
force, and looks."""


def rebounds(spec: dict[str, Any], heights: ArrayLike, finer: float = 1.0) -> np.ndarray:
    """Rebound heights (k,) [mm] of the grain of a drop's run spec (a mapping) from heights (k,)
    [mm], the time step over `finer`."""
    own = parse_spec(spec | {"numerics": _step(STEP, finer)})
    air = _air(own)
    heights = 1e-3 * np.asarray(heights, float)
    radius = mean_radius(own)
    impact = _fall(own, radius, heights, air)
    try:
        place, speed = _bounce(own, radius, impact)
    except BlowUpError as error:
        stiff = f"materials.particle.shear_modulus_Pa = {own.materials.particle.shear_modulus_Pa:g}"
        raise CalibrationError(
            f"a grain of {2e3 * radius:g} mm that drops {1e3 * heights.max():g} mm sinks too deep "
            f"into the plate with {stiff}: state a stiffer grain ({error})"
        ) from None
    return 1e3 * np.maximum(place + _rise(own, radius, speed, air), 0.0)


def _step(numerics, finer):
    return numerics | {"rayleigh_fraction": numerics["rayleigh_fraction"] / finer}


def _plate(spec, gravity=DOWN):
    walls = WallSet().body("plate", material=WALL).plane((0, 0, 0), (0, 0, 1))
    return build_simulation(spec, walls, gravity)


def _contact_time(spec, radius, speed):
    grain, wall = material_of(spec.materials.particle), material_of(spec.materials.wall)
    return hertz_contact_time(radius, speed, grain, wall)


def _bounce(spec, radius, impact):
    """Height above the plate [m] and speed [m/s] (k,) of grains that have left it; 0 where they
    stick."""
    sim = _plate(spec)
    position = np.zeros((len(impact), 3))
    position[:, 0] = 20.0 * radius * np.arange(len(impact))
    position[:, 2] = np.float32(radius)
    velocity = np.zeros_like(position)
    velocity[:, 2] = -impact
    sim.add_particles(position, radius, velocity=velocity)
    duration = _contact_time(spec, radius, float(impact.min()))
    clear = sim._attraction(sim.n)  # a bridge holds beyond the contact
    while sim.time < LONGEST * duration:
        sim.advance(max(round(0.25 * duration / sim.time_step), 1))
        gap = sim.position[:, 2] - np.float32(radius)
        free = (gap > clear) & (sim.velocity[:, 2] > 0.0)
        if free.all():
            break
    return np.where(free, gap, 0.0), np.where(free, sim.velocity[:, 2], 0.0)


def _air(spec):
    if spec.laws.drag == "none":
        return None
    q = spec.law_parameters
    return (q.air_density_kg_m3 or Air.density, q.air_viscosity_Pa_s or Air.viscosity)


def _deceleration(spec, radius, count, air):
    """A function of speeds (count,) [m/s] that gives drag over mass (count,) [m/s2], by the
    engine's law."""
    particles = new_particles(count, "double")
    mass = 4.0 / 3.0 * math.pi * radius**3 * spec.materials.particle.density_kg_m3

    def of(speed):
        particles.kinetic[:count, 0] = speed
        particles.kinetic[:count, 6] = radius
        particles.force[:] = 0.0
        apply_drag(count, particles, *air)
        return -particles.force[:count, 0] / mass

    return of


def _fall(spec, radius, height, air):
    """Impact speed (k,) [m/s]: d(v^2/2)/dz = g - drag(v), by the midpoint rule in the path."""
    if air is None:
        return np.sqrt(2.0 * GRAVITY * height)
    energy, step = np.zeros(len(height)), height / FLIGHT_STEPS
    slowed = _deceleration(spec, radius, len(height), air)
    for _ in range(FLIGHT_STEPS):
        half = energy + 0.5 * step * (GRAVITY - slowed(np.sqrt(2.0 * energy)))
        energy = energy + step * (GRAVITY - slowed(np.sqrt(2.0 * half)))
    return np.sqrt(2.0 * energy)


def _rise(spec, radius, speed, air):
    """Height (k,) [m] that a grain rises: dz = d(v^2/2) / (g + drag(v)), by the midpoint rule in
    the energy."""
    energy = 0.5 * speed**2
    if air is None:
        return energy / GRAVITY
    share = (np.arange(FLIGHT_STEPS) + 0.5) / FLIGHT_STEPS
    height = np.zeros(len(speed))
    slowed = _deceleration(spec, radius, len(speed), air)
    for s in share:
        height += energy / FLIGHT_STEPS / (GRAVITY + slowed(np.sqrt(2.0 * s * energy)))
    return height


def sliding_angles(spec: dict[str, Any], rates: ArrayLike, finer: float = 1.0) -> np.ndarray:
    """Sliding angles (k,) [deg] of the grain of a tilt's run spec (a mapping) at tilt rates (k,)
    [degrees/s], the time step over `finer`.

    A grain at rest under its weight on the plate is pushed until it slips. The friction is the
    force that holds it then, over its weight. On the plate the load is m g cos(theta). The angle is
    read once the spec's slip has been covered."""
    own = parse_spec(spec | {"numerics": _step(COARSE, finer)})
    angle = math.atan(friction(own, 0.0))
    for _ in range(2):
        angle = math.atan(friction(own, angle))
    rate = np.radians(np.asarray(rates, float))
    slip = 1e-3 * own.geometry.slip_mm
    late = np.cbrt(6.0 * slip * math.cos(angle) * rate**2 / GRAVITY)
    return np.degrees(angle + late)


def friction(spec: RunSpec, angle: float) -> float:
    """Tangential over normal weight at which a grain on a plate tilted by `angle` [rad] slips."""
    radius = mean_radius(spec)
    down = GRAVITY * math.cos(angle)
    sim = _plate(spec, (0.0, 0.0, -down))
    sim.add_particles([(0.0, 0.0, np.float32(radius))], radius)
    slow = math.sqrt(2.0 * down * 1e-3 * radius)
    sim.advance(round(SETTLE * _contact_time(spec, radius, slow) / sim.time_step))
    sim.particles.kinetic[:1, :] *= np.array([0, 0, 0, 0, 0, 0, 1, 1], sim.particles.kinetic.dtype)
    sim.particles.kinetic[0, 0] = SLIP_SPEED
    largest = 0.0
    for _ in range(LOOKS):
        sim.advance(LOOK)
        held = abs(float(sim.wall_force("plate")[0])) / (float(sim.mass[0]) * down)
        if held < largest or sim.velocity[0, 0] <= 0.0:
            break
        largest = held
    return largest
