"""Grains that stick, in rigs whose grains differ in size: each stands for a parcel of the material.

A parcel's strength in tension, which is what a powder has, goes with the energy of its surface over
its size. One energy for two sizes would be two materials. A level of a factor holds for the grains
of the study's own rig, and each other rig has the level that keeps this strength there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from calibration.study.config import point_spec
from calibration.study.config.specs import states
from dem.grains.sizes import grain_volume
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.simulated_tests import SimulatedTest

LAW = "law_parameters"
WITH_SIZE = tuple(
    f"{LAW}.{key}"
    for key in (
        "surface_energy_J_m2", "wall_surface_energy_J_m2",
        "adhesion_energy_J_m2", "wall_adhesion_energy_J_m2", "surface_tension_N_m",
    )
)  # fmt: skip
"""Keys of a run whose force goes with a grain's size, and not with its square: pull-off of JKR and
of EEPA, and a liquid bridge's."""


def ratios(config: Config, test: SimulatedTest, keys: Iterable[str]) -> dict[str, float]:
    """{key: by what a level of the study is multiplied in a test} of those among `keys` of factors
    and of the study's run that go with the size of grains; none where the test's grains are as
    large as the study's. A level that the test states itself stays. Raises SpecError."""
    keys = set(keys)
    shared = {k for k in WITH_SIZE if states(config.own_run, k) and not states(test.own, k)}
    found = [k for k in WITH_SIZE if k in keys | shared]
    if not found:
        return {}
    whole = parse_spec(point_spec(config.own_run, config.experiment, {}, 1))
    spec = parse_spec(point_spec(test.run, test.experiment, {}, 1))
    ratio = (grain_volume(spec) / grain_volume(whole)) ** (1 / 3)
    return {} if abs(ratio - 1.0) < 1e-6 else dict.fromkeys(found, float(f"{ratio:.9g}"))


def sized(run: Mapping[str, Any], ratio: Mapping[str, float]) -> dict[str, Any]:
    """A run spec (a mapping) with its own levels of these keys multiplied."""
    law = {
        key.partition(".")[2]: run[LAW][key.partition(".")[2]] * by
        for key, by in ratio.items()
        if states(run, key)
    }
    return {**run, LAW: {**run[LAW], **law}} if law else dict(run)
