"""The engine's own contact, and the catalogue's mechanisms as curves over the settings of one
experiment from it.

A drop or a slide is one contact, integrated by the engine with the laws of a run spec. The fall and
the rise are free flights, so only the contact is stepped through, for grains of one size at many
speeds at once. The same engine, laws and time step as in a run of the experiment: nothing is
trained and nothing interpolated.

A curve is what the mechanism at one strength does to the logarithm of the reading. Its base
coefficient is chosen so that the mean over the settings is that of the data. Settings of one grain
size share a simulation.
"""

import json
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from calibration.errors import CalibrationError
from calibration.study.config import overlay
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
from diagnosis.catalogue import Mechanism
from diagnosis.laws.readings import EXPONENT, Readings, from_log, level_of, to_log
from diagnosis.table_model.block import KnownCurves, curve_shape

FINE, COARSE = 0.01, 0.2
"""Rayleigh fraction of a bounce, whose restitution must be resolved; of a slide, which asks for the
force at rest only."""

LONGEST = 12.0  # elastic contact times after which a grain that has not left counts as stuck
FLIGHT_STEPS = 60
SETTLE, SLIP_SPEED, LOOK, LOOKS = 20.0, 0.2, 5, 400
"""A slide: contact times to come to rest, speed of the push [m/s], steps between looks at the
force, and looks."""


def rebounds(spec: dict[str, Any], heights: ArrayLike) -> np.ndarray:
    """Rebound heights (k,) [mm] of the grain of a drop's run spec (a mapping) from heights (k,)
    [mm]."""
    own = _in_steps(spec, FINE)
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


def _in_steps(spec, fraction):
    return parse_spec(spec | {"numerics": {"rayleigh_fraction": fraction, "precision": "double"}})


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
    height, slowed = np.zeros(len(speed)), _deceleration(spec, radius, len(speed), air)
    for s in (np.arange(FLIGHT_STEPS) + 0.5) / FLIGHT_STEPS:
        height += energy / FLIGHT_STEPS / (GRAVITY + slowed(np.sqrt(2.0 * s * energy)))
    return height


def sliding_angles(spec: dict[str, Any], rates: ArrayLike) -> np.ndarray:
    """Sliding angles (k,) [deg] of the grain of a tilt's run spec (a mapping) at tilt rates (k,)
    [degrees/s].

    A grain at rest under its weight on the plate is pushed until it slips. The friction is the
    force that holds it then, over its weight. On the plate the load is m g cos(theta). The angle is
    read once the spec's slip has been covered."""
    own = _in_steps(spec, COARSE)
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


STEPS, CURVES = 11, 21
"""Strengths at which the engine is asked, and between which the curves are interpolated."""

SECANTS = 2
LATTICE = 0.015  # of the logarithm of a coefficient; what is left of it the level takes up
COEFFICIENT = {"drop": ("restitution", 0.03, 1.0), "tilt": ("static_friction", 0.005, 5.0)}
NO_COEFFICIENT = {"viscoelastic_restitution"}


def known_curves(
    catalogue: Mapping[str, Mechanism], spec_of: Callable[[str, dict[str, float]], dict[str, Any]]
) -> KnownCurves:
    """A function of readings that gives what every mechanism of the experiment adds to their
    logarithms about the centre, as shapes of its place: [((slot, state), `Shape`)].

    spec_of: (experiment, levers) -> run spec (a mapping) of a condition.
    """

    def make(readings):
        kind = readings.experiment
        own = [m for m in catalogue.values() if m.law and kind in m.experiments]
        found = [(m.law, _known(m, readings, spec_of)) for m in own if kind in COEFFICIENT]
        return [((slot, tuple(state)), s) for (slot, state), s in found if s is not None]

    return make


def _known(mechanism, readings, spec_of):
    coded, centre = np.linspace(0.0, 1.0, STEPS), readings.centre
    rows = [_curve(mechanism, float(c), readings, centre, spec_of) for c in coded]
    good = [i for i, r in enumerate(rows) if r is not None]
    if len(good) < 3:
        return None
    fine = np.linspace(coded[good[0]], coded[good[-1]], CURVES)
    curves = CubicSpline(coded[good], np.array([rows[i] for i in good]))(fine)
    if np.ptp(curves - curves.mean(1, keepdims=True), axis=0).max() < 1e-4:
        return None  # it does not show on these levers
    own_level = mechanism.name in NO_COEFFICIENT
    return curve_shape(mechanism.name, fine, curves, catalogue=True, own_level=own_level)


def _curve(mechanism, coded, readings, centre, spec_of):
    """(n,) logarithms less the centre at a coded strength, or None where no coefficient meets the
    data's mean."""
    strength = float(mechanism.strength.natural(coded))
    if mechanism.observe is not None:
        return observed_log(mechanism, strength, centre, readings) - centre
    name, low, high = COEFFICIENT[readings.experiment]
    target = LATTICE * round(float(centre.mean()) / LATTICE)
    power = EXPONENT[readings.experiment]
    value = _on_lattice(target / power, low, high)
    for _ in range(1 if mechanism.name in NO_COEFFICIENT else SECANTS):

        def switched(spec, value=value):
            return mechanism.apply(with_coefficient(spec, name, value), strength)

        log = contact_logs(switched, readings, spec_of)
        if not np.isfinite(log).all():
            return None
        miss = target - float(log.mean())
        moved = _on_lattice(np.log(value) + miss / power, low, high)
        if moved == value:
            break
        value = moved
    if mechanism.name in NO_COEFFICIENT:
        return log - centre
    # the engine without it has trends of its own, such as the slip after which a slide is seen
    own = log - contact_logs(lambda s: with_coefficient(s, name, value), readings, spec_of)
    return own - own.mean()


def observed_log(
    mechanism: Mechanism, strength: float, log: np.ndarray, readings: Readings
) -> np.ndarray:
    """(n,) logarithms of what would have been read in place of true values with logarithms (n,)."""
    true = from_log(readings.experiment, log, readings.levers)
    given = [
        {k: float(v[i]) for k, v in readings.levers.items() if not np.isnan(v[i])}
        for i in range(len(true))
    ]
    seen = [mechanism.observe(t, c, strength) for t, c in zip(true, given, strict=True)]  # type: ignore[misc]
    return to_log(readings.experiment, np.array(seen, float), readings.levers)[0]


def _on_lattice(log, low, high):
    """A coefficient near exp(log) that other data sets have, too, so that its contacts are computed
    once."""
    return float(np.clip(np.exp(LATTICE * round(log / LATTICE)), low, high))


def with_coefficient(spec: dict[str, Any], name: str, value: float) -> dict[str, Any]:
    """Run spec (a mapping) with a coefficient of grains on the plate."""
    return overlay(spec, {"contacts": {"particle_wall": {name: round(float(value), 9)}}})


READ = {"drop": ("drop_height_mm", rebounds), "tilt": ("tilt_rate_deg_s", sliding_angles)}
"""{experiment: (lever along which one contact is asked, how)}."""


def contact_logs(
    switched: Callable[[dict[str, Any]], dict[str, Any]],
    readings: Readings,
    spec_of: Callable[[str, dict[str, float]], dict[str, Any]],
) -> np.ndarray:
    """(n,) logarithms of what the engine's one contact reads at each setting.

    switched: run spec (a mapping) -> the one with the laws to be run."""
    kind, levers, out = readings.experiment, readings.levers, np.empty(len(readings.log))
    lever, _ = READ[kind]
    sizes = levers.get("particle_diameter_mm", np.full(len(out), np.nan))
    for rows in (level_of(sizes) == k for k in range(len(np.unique(sizes)))):
        along, size = levers.get(lever, np.full(len(out), 5.0))[rows], float(sizes[rows][0])
        given = {} if np.isnan(size) else {"particle_diameter_mm": size}
        spec = switched(spec_of(kind, given | {lever: float(along[0])}))
        values, place = np.unique(along, return_inverse=True)
        out[rows] = np.array(_asked(kind, json.dumps(spec, sort_keys=True), tuple(values)))[place]
    with np.errstate(divide="ignore"):
        return to_log(kind, out, levers)[0]


@lru_cache(maxsize=20000)
def _asked(experiment, text, values):
    return tuple(READ[experiment][1](json.loads(text), np.array(values)))
