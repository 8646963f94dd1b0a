"""The comment at the head of each export: what it is, where its numbers come from, and what it
leaves out."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dem.materials import laws_of

if TYPE_CHECKING:
    from calibration.engines.blocks.conversion import Conversion
    from dem.spec import RunSpec


WIDTH = 110


def header(
    mark: str, title: str, about: Sequence[str], conversion: Conversion, code: str, *notes: str
) -> list[str]:
    """Comment lines behind `mark`: title, provenance (lines), how rolling friction was converted,
    what differs in the `code`, and notes. conversion: `Conversion`."""
    called = conversion.export("rolling", code).called
    out = []
    for text in (title, *about, *conversion.sentences(called), *notes):
        out += [f"{mark} {line}" for line in textwrap.wrap(text, WIDTH - len(mark))]
    return out


def dispensed(spec: RunSpec, code: str) -> list[str]:
    """Sentences on the laws of the calibrated `RunSpec` that `code` does not have and a heap does
    not need."""
    lost = [law for law in laws_of(spec).chosen() if code not in law.exports]
    return [law.left_out for law in lost if law.dispensable]


def left_out(spec: RunSpec, code: str = "") -> list[str]:
    """Sentences on what the export to a code does not carry over of the calibrated `RunSpec`; any
    code unless given."""
    lost = [law for law in laws_of(spec).chosen() if code not in law.exports]
    out = [law.left_out for law in lost if law.left_out and not law.dispensable]
    if spec.particles.elongation != 1.0:
        out.append(
            f"NOT CONVERTED: grains {spec.particles.elongation:g} times as long as wide; these are "
            f"spheres of the same "
            "volume."
        )
    if spec.particles.clump is not None:
        number = len(spec.particles.clump.radius_mm)
        out.append(
            f"NOT CONVERTED: grains of {number} bonded spheres; these are spheres of the same "
            "volume."
        )
    if spec.particles.sizes is not None:
        out.append("The mean grain stands for all sizes where a number depends on the size.")
    return out
