"""Runs that test the scaling claim: a heap and a drop enlarged by a rule, grain and rig alike.

The unit in the name of a run spec's key says which quantity it is, so one table turns a rule into a
run spec. Gravity is the Earth's in every run: a rule that would have it scaled is tried as the
paper applies it, with everything else scaled. The number of grains is the same at every scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from calibration.chain.scaling.dimensions import RULES, ScalingError, factors
from calibration.runs.plans import together, write_plan
from calibration.study.config import given, overlay, point_spec
from dem.spec import OPTIONAL, REQUIRED, parse_spec
from dem.units import unit_of

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.scaling.dimensions import Rule
    from calibration.chain.study import Study
    from calibration.study.config import Config
    from calibration.study.config.schema import ScalingConfig


EXPERIMENTS = ("heap", "drop")
HELD_IN = {
    "kg/m³": "density",
    "Pa": "modulus",
    "kPa": "stress",
    "J/m³": "cohesion_energy_density",
    "J/m²": "surface_energy",
    "N/m": "surface_energy",
    "N": "force",
    "Pa·s": "viscosity",
    "m/s": "velocity",
    "mm/s": "velocity",
    "mm": "length",
    "1/s": "angular_velocity",
    "°/s": "angular_velocity",
    "s": "time",
}
"""Unit of a run spec's key -> the quantity of `scaling.DIMENSIONS` that the key holds."""

COHESION = {
    name
    for (slot, _), groups in REQUIRED.items()
    if slot == "cohesion"
    for group in groups
    for name in group
} | {name for (slot, _), names in OPTIONAL.items() if slot == "cohesion" for name in names}
NOT_SCALED = ("output", "seed")  # what is written, not what is simulated


def quantity_of(key: str) -> str | None:
    """Quantity of `scaling.DIMENSIONS` that a run spec's key holds, by its unit; None for a number
    without one."""
    return HELD_IN.get(unit_of(key))  # type: ignore[arg-type]


def enlarged(run: Mapping[str, Any], experiment: str, rule: Rule, h: float) -> dict[str, Any]:
    """The run spec `run` (a mapping without experiment and seed), defaults put in, enlarged h times
    by `rule`.

    Raises ScalingError for a mesh, which has no key to scale, and for a law as a curve; SpecError
    as `dem.spec.parse_spec` does.
    """
    spec = parse_spec(point_spec(run, experiment, {}, 1)).model_dump(mode="json")
    factor = factors(rule.held, h)
    return {
        section: value if section in NOT_SCALED else _scaled(value, factor)
        for section, value in spec.items()
        if section not in ("experiment", "seed")
    }


def _scaled(part, factor, key=""):
    if isinstance(part, dict):
        return {k: _scaled(v, factor, k) for k, v in part.items()}
    if key.endswith("_stl") and part is not None:
        raise ScalingError(f"{key}: a mesh cannot be enlarged here; use the analytic rig")
    if key.endswith("_curve_low") and part is not None:
        raise ScalingError(
            f"{key}: the states of a curve, whose unit its powers make, cannot be enlarged here; "
            "use a law with a constant coefficient"
        )
    quantity = quantity_of(key)
    if quantity is None or part is None:
        return part
    if isinstance(part, list):
        return [round_off(x * factor[quantity]) for x in part]
    return round_off(part * factor[quantity])


def round_off(value: float) -> float:
    """Nine significant digits: the last bits of a power would rename a cached run."""
    return float(f"{value:.9g}")


def base_run(config: Config, experiment: str, cohesive: bool) -> dict[str, Any]:
    """The run spec at scale 1, without experiment and seed; the study's own cohesion is left out of
    it."""
    section = config.scaling
    run = overlay(config.run, getattr(section, experiment))
    laws = run.get("laws", {}) | {"cohesion": "none"}
    constants = {k: v for k, v in run.get("law_parameters", {}).items() if k not in COHESION}
    run |= {"laws": laws, "law_parameters": constants}
    return overlay(run, section.cohesion) if cohesive else run  # type: ignore[union-attr]  # the stage has its section


def seeds_of(section: ScalingConfig, experiment: str, cohesive: bool, h: float) -> int:
    """Number of runs of a case. The runs at both ends of the scale decide the slope. Cohesive heaps
    scatter more."""
    if experiment == "drop":
        return section.drop_seeds
    if h not in (section.factors[0], section.factors[-1]):
        return section.seeds
    ends = section.end_seeds or section.seeds
    return section.cohesive_end_seeds or ends if cohesive else ends


def plan_scaling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan every experiment under every rule and scale, without and with cohesion, with all
    seeds."""
    config, parts = study.config, []
    section = given(config, "scaling", "scaling")
    cases = product(EXPERIMENTS, RULES, (False, True), section.factors)
    for experiment, rule, cohesive, h in cases:
        run = enlarged(base_run(config, experiment, cohesive), experiment, RULES[rule], h)
        rows = pd.DataFrame([section.point] * seeds_of(section, experiment, cohesive, h))
        rows = rows.assign(rule=rule, cohesive=cohesive, scale=h)
        parts.append(study.plan(rows, experiment, run))
    write_plan(Path(output.plan).parent, *together(parts))
