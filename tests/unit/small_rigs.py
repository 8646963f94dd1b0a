"""What runs that take seconds share."""

ROUGH = {
    "particle_particle": {"restitution": 0.55, "static_friction": 0.85, "rolling_friction": 0.1},
    "particle_wall": {"restitution": 0.4, "static_friction": 0.7, "rolling_friction": 0.35},
}
"""Contacts of grains that pile up in these rigs."""
