"""The bench tests that sweep one parameter: which key each calibrates, and what it measures."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sweep:
    """A bench test that calibrates the factor of one key of the run spec. `repeats` is the geometry
    key of the repeats within a run."""

    key: str
    metric: str
    spread: str
    repeats: str


SWEEPS = {
    "tilt": Sweep(
        "contacts.particle_wall.static_friction", "sliding_angle_deg", "sliding_angle_sd_deg",
        "trials",
    ),
    "drop": Sweep(
        "contacts.particle_wall.restitution", "rebound_height_mm", "rebound_height_sd_mm", "drops",
    ),
}  # fmt: skip
