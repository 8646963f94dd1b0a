"""What a valid spec should still be warned about before it runs."""

from dem.experiments import experiment_of
from dem.experiments.setup import time_step_of
from dem.grains import smallest_radius
from dem.materials import laws_of, material_of
from dem.timescales import hertz_contact_time
from dem.units import question


def limits_of(spec):
    """Sentences on what a calibration with the laws of a `RunSpec` does not hold for. The list is
    empty if they hold in motion too."""
    if spec.contacts.particle_particle.rolling_friction == 0.0:
        return []
    return [
        f"laws.{law.slot} {law.name} {law.holds_at_rest}: the result holds for heaps and beds at "
        f"rest or sheared "
        "slowly, not for grains in a drum or mixer; there calibrate with a law on the relative "
        "spin and torsion"
        for law in laws_of(spec).chosen()
        if law.holds_at_rest
    ]


def warnings_of(spec):
    """Sentences, each with the setting to change, about a valid `RunSpec`; an empty list when all
    is well."""
    experiment = experiment_of(spec)
    doubtful = _doubtful(spec.model_dump(mode="json"))
    return [*doubtful, *experiment.advice(spec), *_short_contacts(experiment, spec)]


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
    """A time step that resolves the shortest contact too coarsely: its restitution comes out
    low."""
    if experiment.impact_speed is None:
        return []
    speed = experiment.impact_speed(spec)
    steps = _steps_per_contact(spec, speed)
    if steps >= experiment.least_steps:
        return []
    return [
        f"an impact at {speed:.2g} m/s lasts {steps:.1f} time steps; below "
        f"{experiment.least_steps} the "
        "restitution is not the one asked for: lower numerics.rayleigh_fraction"
    ]


def _steps_per_contact(spec, speed):
    """Of the smallest grain on the wall, which is the shortest contact: grains on grains are softer
    and lighter."""
    grain = material_of(spec.materials.particle)
    wall = material_of(spec.materials.wall)
    return hertz_contact_time(smallest_radius(spec), speed, grain, wall) / time_step_of(spec)
