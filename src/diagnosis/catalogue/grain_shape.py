"""Elongated grains: two bonded spheres with the volume of the stated one."""

from calibration.study.config import overlay
from diagnosis.catalogue import Mechanism, Strength

LONGEST = 1.6  # longer grains do not pass the funnel that stands in the rig for coarse spheres

MECHANISM = Mechanism(
    name="grain_shape",
    description="elongated grains roll less than spheres do; a heap that rolling friction "
    "hardly holds stands steeper",
    source="Wensrich, Katterfeld (2012), Powder Technol. 217:409",
    experiments=("heap",),
    strength=Strength("length over width", "1", 1.0, LONGEST, off=1.0),
    apply=lambda spec, s: overlay(spec, {"particles": {"elongation": s}}),
)
