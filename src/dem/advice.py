"""What a valid spec should still be warned about before it runs."""

import math

from dem.experiments.setup import (
    largest_reach,
    material_of,
    mean_radius,
    smallest_radius,
    time_step_of,
)
from dem.timescales import hertz_contact_time
from dem.units import question

GRAVITY = 9.81
FREE_FLOW_RATIO = 5.0
"""Orifice over largest grain below which arches stop the flow at times (Zuriguel et al. 2005, Physical Review E
71:051303)."""

MIN_STEPS = {"heap": 5, "drop": 20}
"""Steps in the shortest contact below which a run is warned of. At 5 the restitution comes out 2 % low, at 20 one
per cent (docs/verification.md, steps in a contact); the rebound of a drop goes with its square."""


def impact_speed(spec):
    """Highest speed [m/s] at which grains are expected to hit, or None where nothing falls."""
    if spec.experiment == "drop":
        return math.sqrt(2.0 * GRAVITY * 1e-3 * spec.geometry.drop_height_mm)
    if spec.experiment == "heap":
        return math.sqrt(2.0 * GRAVITY * 1e-3 * spec.geometry.discharge_height_mm)
    return None


def warnings_of(spec):
    """Sentences, each with the setting to change, about a valid `RunSpec`; an empty list when all is well."""
    found = _doubtful(spec.model_dump(mode="json"))
    if spec.experiment == "heap":
        ratio = 0.5e-3 * spec.geometry.orifice_diameter_mm / largest_reach(spec)
        if ratio < FREE_FLOW_RATIO:
            found.append(
                f"geometry.orifice_diameter_mm is {ratio:.1f} of the largest grain; below "
                f"{FREE_FLOW_RATIO:g} the funnel may clog"
            )
    speed = impact_speed(spec)
    if speed is not None:
        steps = _steps_per_contact(spec, speed)
        if steps < MIN_STEPS[spec.experiment]:
            found.append(
                f"an impact at {speed:.2g} m/s lasts {steps:.1f} time steps; below "
                f"{MIN_STEPS[spec.experiment]} the restitution is not the one asked for: lower "
                "numerics.rayleigh_fraction"
            )
    if spec.experiment == "tilt":
        limit = _tipping_slope(spec)
        friction = spec.contacts.particle_wall.static_friction
        if friction >= limit:
            found.append(
                f"contacts.particle_wall.static_friction is {friction:g}; from {limit:.2g} on the cluster may tip "
                "before it slides and the angle is not that of friction: raise geometry.spacing_mm"
            )
    return found


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


def _tipping_slope(spec):
    """Tangent of the least tilt at which the weight leaves the square on which the cluster of four stands."""
    spacing = spec.geometry.spacing_mm
    return 1.0 if spacing is None else 1e-3 * spacing / mean_radius(spec)


def _steps_per_contact(spec, speed):
    """Of the smallest grain on the wall, which is the shortest contact: grains on grains are softer and lighter."""
    grain = material_of(spec.materials.particle)
    wall = material_of(spec.materials.wall)
    return hertz_contact_time(smallest_radius(spec), speed, grain, wall) / time_step_of(spec)
