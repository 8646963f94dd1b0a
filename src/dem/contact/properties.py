"""What a force law may know of the two materials in contact, and the choice of laws; both are fixed
for a run."""

from __future__ import annotations

from collections import namedtuple
from typing import TYPE_CHECKING, Any, TypeAlias

from dem.contact.catalogue import SLOTS, every_law

if TYPE_CHECKING:
    # made below of what the laws declare, which no type checker reads
    LawCodes: TypeAlias = Any
    PairProperties: TypeAlias = Any

LawCodes = namedtuple("LawCodes", SLOTS, module=__name__)  # type: ignore[misc,no-redef]
LawCodes.__doc__ = "Number of the law in each slot, as `dem.contact.catalogue.CODES` has it."

BASE = ("young", "shear", "friction", "rolling")
PairProperties = namedtuple(  # type: ignore[misc,no-redef]
    "PairProperties",
    (*BASE, *dict.fromkeys(name for one in every_law() for name in one.constants)),
    module=__name__,
)
PairProperties.__doc__ = """Constants of a pair of materials and of the chosen laws.

SI units; the constants of other laws are 0.

young: effective Young's modulus E*, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 [Pa]; shear: effective
shear modulus G*, 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 [Pa]; friction, rolling: coefficients of static
and rolling friction [-]; then what the laws declare.
"""
