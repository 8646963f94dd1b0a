"""Constants of nature that more than one file needs."""

GRAVITY = 9.81
"""Acceleration of a free fall [m/s2]: the paper's value, to three digits."""

DOWN = (0.0, 0.0, -GRAVITY)
"""Gravity as a vector (3,) [m/s2] in a rig whose z axis points up."""
