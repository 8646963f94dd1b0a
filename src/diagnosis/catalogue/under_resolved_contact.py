"""The contact lasts too few time steps and returns another restitution than it should."""

from dem.spec import MAX_RAYLEIGH_FRACTION, parse_spec
from dem.timescales import rayleigh_time
from diagnosis.catalogue import Mechanism, Strength

RADIUS = 0.5e-3  # of the grain in whose Rayleigh time the step is counted [m]
# what a coarse step costs depends on where in a step the contact begins: so many phases are
# averaged
DROPS = 100


def apply(spec, strength):
    """The same time step at every condition, as one setting of a code gives; at most what the
    engine takes."""
    parsed = parse_spec(spec)
    grain = parsed.materials.particle
    material = grain.density_kg_m3, grain.shear_modulus_Pa, grain.poisson_ratio
    radius = 0.5e-3 * parsed.particles.diameter_mm * parsed.particles.scale_factor
    step = min(
        strength * rayleigh_time(RADIUS, *material),
        MAX_RAYLEIGH_FRACTION * rayleigh_time(radius, *material),
    )
    numerics = {k: v for k, v in spec.get("numerics", {}).items() if k != "rayleigh_fraction"}
    geometry = spec["geometry"] | {"drops": max(spec["geometry"].get("drops", 1), DROPS)}
    return spec | {"numerics": numerics | {"time_step_s": step}, "geometry": geometry}


MECHANISM = Mechanism(
    name="under_resolved_contact",
    description="too few time steps in a contact change its restitution, most for small grains",
    source="integration error of the damped contact; falls with the time step, which no effect of "
    "nature does",
    experiments=("drop",),
    levers=("particle_diameter_mm", "drop_height_mm"),
    strength=Strength("time step over the Rayleigh time of 1 mm", "1", 0.03, 0.36),
    apply=apply,
)
