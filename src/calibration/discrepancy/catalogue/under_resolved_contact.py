"""The contact lasts too few time steps and returns another restitution than it should."""

from calibration.discrepancy.catalogue import Mechanism, Strength


def apply(spec, strength):
    """The same time step, in units of 10 us, at every condition, as one setting of a code gives."""
    numerics = {k: v for k, v in spec.get("numerics", {}).items() if k != "rayleigh_fraction"}
    return spec | {"numerics": numerics | {"time_step_s": 1e-5 * strength}}


MECHANISM = Mechanism(
    name="under_resolved_contact",
    description="too few time steps in a contact change its restitution, most for small grains",
    source="integration error of the damped contact; falls with the time step, which no effect of nature does",
    experiments=("drop",),
    levers=("particle_diameter_mm", "drop_height_mm"),
    strength=Strength("time step", "10 us", 0.1, 1.0, 0.8, log=True),
    apply=apply,
)
