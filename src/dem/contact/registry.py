"""The choice of laws of a run, its materials, and what is compiled of them for the kernels."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass, field, make_dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any, TypeAlias

from dem.contact.catalogue import CODES, LAWS, SLOTS, clashes, completed, every_law
from dem.contact.catalogue import DEFAULTS as DEFAULTS

if TYPE_CHECKING:
    from dem.contact.law import Law

    # made below of what the laws declare, which no type checker reads
    LawCodes: TypeAlias = Any
    PairProperties: TypeAlias = Any
    Laws: TypeAlias = Any
    ContactParameters: TypeAlias = Any


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


class _Choice:
    """One law in each slot, by name; slots that are not named have their default, see
    `dem.contact.catalogue.completed`."""

    def __post_init__(self):
        named = {slot: getattr(self, slot) for slot in SLOTS if getattr(self, slot) is not None}
        for slot, name in completed(named).items():
            object.__setattr__(self, slot, name)

    def codes(self) -> LawCodes:
        """Integer codes for the kernels. Raises ValueError on an unknown name or a pair that cannot
        be combined."""
        for clash in self.clashes():
            raise ValueError("{0} {1} goes with {2} {4}, not {3}".format(*clash))
        return LawCodes(*(CODES[slot][getattr(self, slot)] for slot in SLOTS))

    def chosen(self) -> list[Law]:
        """The `Law`s, slot by slot. Raises ValueError on an unknown name."""
        for slot in SLOTS:
            name = getattr(self, slot)
            if name not in LAWS[slot]:
                raise ValueError(f"{slot}: unknown law {name!r}; known: {', '.join(LAWS[slot])}")
        return [LAWS[slot][getattr(self, slot)] for slot in SLOTS]

    def clashes(self) -> list[tuple[str, str, str, str, str]]:
        """`dem.contact.catalogue.clashes` of the choice. Raises ValueError on an unknown name."""
        return clashes({one.slot: one.name for one in self.chosen()})


Laws = make_dataclass(  # type: ignore[misc,assignment]
    "Laws",
    [(slot, str | None, None) for slot in SLOTS],
    bases=(_Choice,),
    frozen=True,
    namespace={"__module__": __name__, "__doc__": _Choice.__doc__},
)


@dataclass(frozen=True)
class Material:
    """Elastic constants: density [kg/m3], shear modulus [Pa], Poisson's ratio [-]."""

    density: float
    shear_modulus: float
    poisson_ratio: float

    @property
    def young_modulus(self) -> float:
        """E = 2 G (1 + nu) [Pa]."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


_LAW_FIELDS = {
    p.name: (p.name, float, p.unset if p.default is None else p.to_si(p.default, None))
    for one in every_law()
    for p in one.parameters
}  # some are parameters of several laws


ContactParameters = make_dataclass(  # type: ignore[misc,assignment]
    "ContactParameters",
    [
        ("restitution", float),
        ("static_friction", float),
        ("rolling_friction", float, 0.0),
        *_LAW_FIELDS.values(),
        ("note", str, field(default="", compare=False)),
    ],
    frozen=True,
    namespace={
        "__module__": __name__,
        "__doc__": "What a pair of materials adds to the two materials; SI units. Unused laws "
        "ignore their entries.",
    },
)


def pair_properties(
    laws: Laws, a: Material, b: Material, contact: ContactParameters
) -> PairProperties:
    """Compile two `Material`s and their `ContactParameters` into `PairProperties` for the chosen
    `Laws`. Raises ValueError for a restitution outside 0 to 1."""
    if not 0.0 <= contact.restitution <= 1.0:
        raise ValueError(f"restitution {contact.restitution:g}; allowed: 0 to 1")
    nu_a, nu_b = a.poisson_ratio, b.poisson_ratio
    young = 1.0 / ((1.0 - nu_a**2) / a.young_modulus + (1.0 - nu_b**2) / b.young_modulus)
    shear = 1.0 / ((2.0 - nu_a) / a.shear_modulus + (2.0 - nu_b) / b.shear_modulus)
    base = (young, shear, contact.static_friction, contact.rolling_friction)
    values = dict.fromkeys(PairProperties._fields, 0.0) | dict(zip(BASE, base, strict=True))
    for one in laws.chosen():
        given = {name: getattr(contact, name) for name in one.constants if hasattr(contact, name)}
        values |= given | one.values(contact)
    return PairProperties(**values)


def attraction_reach(laws: Laws, properties: PairProperties, radius: float) -> float:
    """Largest gap [m] at which this pair of materials still attracts, for grains up to radius
    [m]."""
    given = {"p": properties, "r_eff": radius, "grain": radius}
    spans = [one.kernels["reach"].py_func for one in laws.chosen() if "reach" in one.kernels]
    return max((f(*(given[name] for name in signature(f).parameters)) for f in spans), default=0.0)
