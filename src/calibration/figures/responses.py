"""Metrics and differences between them as a reader sees them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from calibration.figures.labels import response_of as by_its_name
from calibration.statistics.numbers import fixed
from dem.units import without_unit

if TYPE_CHECKING:
    from calibration.figures.labels import Response

NAMES = {
    "arched": "arch over the orifice",
    "beverloo_constant": "Beverloo constant",
    "froude_number": "Froude number",
    "hausner_ratio": "Hausner ratio",
    "hold_up": "most grains in the funnel",
    "in_funnel": "grains left in the funnel",
    "on_plate": "grains on the plate",
    "share_in_funnel": "share left in the funnel",
    "spilled": "grains spilled",
    "steps_per_contact": "time steps in a contact",
    "strain_at_load": "strain under the load",
}
"""Metrics whose own names, written apart, would name no quantity: what people call them."""
SCATTER = "_sd"


def response_of(metric: str) -> Response:
    """`Response` of a run's metric, whose name ends in its unit (angle_of_repose_deg), under the
    name that people give it."""
    found, bare = by_its_name(metric), without_unit(metric)
    if bare.endswith(SCATTER):
        return replace(found, name=f"scatter of the {_name(bare.removesuffix(SCATTER))}")
    return replace(found, name=_name(bare))


def _name(bare):
    return NAMES.get(bare, by_its_name(bare).name)


def difference_of(found: Mapping[str, Any]) -> tuple[str, str, str]:
    """(difference, low, high) in words, of a comparison (a mapping with `difference`,
    `difference_low`, `difference_high` in one unit): all to the decimals that give the farther end
    of the interval three digits. A difference has no digits that its interval does not bear."""
    values = [found["difference"], found["difference_low"], found["difference_high"]]
    most = max(map(abs, values))
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0 else 0
    said = [fixed(value, decimals, "+").replace("-", "−") for value in values]
    return said[0], said[1], said[2]
