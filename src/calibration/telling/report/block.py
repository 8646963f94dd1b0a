"""The whole block to type in: every parameter of the calibrated model, and what was held fixed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml

from calibration.chain.study import Results
from calibration.figures import PLACES, label
from calibration.telling.report.known import posterior_of
from dem.errors import DemError
from dem.spec import load_spec
from dem.units import unit_of, without_unit

if TYPE_CHECKING:
    from pathlib import Path


ORDER = (
    "contacts.particle_particle",
    "contacts.particle_wall",
    "materials.particle",
    "materials.wall",
)
ORDER += ("particles", "laws", "law_parameters")


def block(study: Path) -> list[dict[str, str]]:
    """Rows [{heading: text}] of the calibrated model, what was calibrated first in its group; empty
    without one."""
    path = study / "calibrated.yaml"
    if not path.exists():
        return []
    found = yaml.safe_load(path.read_text("utf-8")).get("parameters", {})
    posterior = posterior_of(Results(study)) or {"parameters": {}}
    rows = [
        _row(place, key, entry, posterior["parameters"].get(entry.get("factor")))
        for place in ORDER
        for key, entry in found.items()
        if key.startswith(f"{place}.") and entry["value"] != "none"
    ]
    return rows + _time_step(study)


def _row(place, key, entry, known):
    name = key.removeprefix(f"{place}.")
    value = entry["value"]
    return {
        "where": PLACES[place],
        "parameter": label(without_unit(name)),
        "value": f"{value:.4g}" if isinstance(value, float) else label(str(value)),
        "unit": unit_of(name) or "",
        "how it is known": _source(entry, known),
    }


def _source(entry, known):
    """Words for where a value comes from, with its interval where it was calibrated: the
    posterior's, where `known` has it."""
    if entry["source"] != "calibrated":
        return entry["source"]
    if known:
        low, high = known["interval"]
        said = f"95 %: {low:.3g} to {high:.3g}" if known["bounded"] else "not bounded by the data"
        return f"calibrated; {said}"
    low, high = entry["interval_95_others_held"]
    open_ends = entry.get("not_bounded_by_the_data", [])
    if len(open_ends) == 2:
        return "calibrated; its own interval is not bounded by the data"
    if open_ends:
        side = f"below {high:.3g}" if "low" in open_ends else f"above {low:.3g}"
        return f"calibrated; 95 % only if the others are right: {side}"
    return f"calibrated; 95 % only if the others are right: {low:.3g} to {high:.3g}"


def _time_step(study):
    """The row of the time step, of the run spec among the exports."""
    from dem.experiments.setup import time_step_of  # loads the engine

    try:
        spec = load_spec(study / "exports" / "dem.yaml")
    except DemError:
        return []
    fraction = f"{spec.numerics.rayleigh_fraction:g} of the Rayleigh time of the smallest grain"
    return [
        {
            "where": "simulator",
            "parameter": "time step",
            "value": f"{time_step_of(spec):.4g}",
            "unit": "s",
            "how it is known": fraction,
        }
    ]
