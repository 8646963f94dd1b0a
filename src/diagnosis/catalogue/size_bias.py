"""Grains that are larger or smaller than stated, the same number of them."""

from calibration.study.config import overlay
from diagnosis.catalogue import Mechanism, Strength, coarse

MECHANISM = Mechanism(
    name="size_bias",
    description="the stated diameter is off by a factor; shows where the rig is small against "
    "the grains",
    source="sieving passes grains by their second largest dimension",
    experiments=("heap",),
    strength=Strength("true over stated diameter", "1", 0.75, 1.3, off=1.0),
    apply=lambda spec, s: overlay(spec, {"particles": {"scale_factor": coarse(spec) * s}}),
)
