"""Names of the laws, their integer codes inside the kernels, and what each needs to know.

A new law is a file in its slot's folder, a line here, and its branch in `dem.contact.model`.
"""

import math
from dataclasses import dataclass, field

from dem.contact.cohesion import jkr as jkr_law
from dem.contact.cohesion import liquid_bridge as bridge_law
from dem.contact.damping import plastic as plastic_law
from dem.contact.damping import thornton as thornton_law
from dem.contact.damping import tsuji as tsuji_law
from dem.contact.properties import LawCodes, PairProperties
from dem.contact.rolling import elastic_plastic as elastic_plastic_law

TSUJI, THORNTON, VISCOELASTIC, PLASTIC = range(4)
CONSTANT_FRICTION, STRESS_DEPENDENT = range(2)
NO_ROLLING, CONSTANT_TORQUE, CONSTANT_TORQUE_RELATIVE, ELASTIC_PLASTIC = range(4)
NO_COHESION, SJKR, JKR, LIQUID_BRIDGE = range(4)
NO_TORSION, MARSHALL = range(2)

DAMPING = {"tsuji": TSUJI, "thornton": THORNTON, "viscoelastic": VISCOELASTIC, "plastic": PLASTIC}
FRICTION = {"constant": CONSTANT_FRICTION, "stress_dependent": STRESS_DEPENDENT}
ROLLING = {
    "none": NO_ROLLING,
    "constant_torque": CONSTANT_TORQUE,
    "constant_torque_relative": CONSTANT_TORQUE_RELATIVE,
    "elastic_plastic": ELASTIC_PLASTIC,
}
COHESION = {"none": NO_COHESION, "sjkr": SJKR, "jkr": JKR, "liquid_bridge": LIQUID_BRIDGE}
TORSION = {"none": NO_TORSION, "marshall": MARSHALL}


@dataclass(frozen=True)
class Laws:
    """One law in each slot, by name."""

    damping: str = "tsuji"
    friction: str = "constant"
    rolling: str = "constant_torque"
    cohesion: str = "none"
    torsion: str = "none"
    drag: str = "none"

    def codes(self):
        """Integer codes for the kernels. Raises ValueError on an unknown name or a pair that cannot be combined."""
        slots = (
            ("damping", DAMPING),
            ("friction", FRICTION),
            ("rolling", ROLLING),
            ("cohesion", COHESION),
            ("torsion", TORSION),
        )
        for slot, known in slots:
            if getattr(self, slot) not in known:
                raise ValueError(
                    f"{slot}: unknown law {getattr(self, slot)!r}; known: {', '.join(known)}"
                )
        if self.drag not in ("none", "schiller_naumann"):
            raise ValueError(f"drag: unknown law {self.drag!r}; known: none, schiller_naumann")
        if self.cohesion == "jkr" and self.damping in ("viscoelastic", "plastic", "thornton"):
            raise ValueError(
                f"cohesion jkr gives its own normal force and goes with damping tsuji, not {self.damping}"
            )
        return LawCodes(*(known[getattr(self, slot)] for slot, known in slots))


@dataclass(frozen=True)
class Material:
    """Elastic constants: density [kg/m3], shear modulus [Pa], Poisson's ratio [-]."""

    density: float
    shear_modulus: float
    poisson_ratio: float

    @property
    def young_modulus(self):
        """E = 2 G (1 + nu) [Pa]."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


@dataclass(frozen=True)
class ContactParameters:
    """What a pair of materials adds to the two materials; SI units. Unused laws ignore their entries."""

    restitution: float
    static_friction: float
    rolling_friction: float = 0.0
    cohesion_energy_density: float = 0.0
    surface_energy: float = 0.0
    surface_tension: float = 0.0
    contact_angle: float = 0.0
    liquid_volume_fraction: float = 0.0
    viscous_time: float = 0.0
    yield_pressure: float = math.inf
    friction_exponent: float = 0.0
    friction_reference: float = 1.0
    rolling_stiffness: float = 2.25
    rolling_damping: float = 0.3
    note: str = field(default="", compare=False)


def pair_properties(laws, a, b, contact):
    """Compile two `Material`s and their `ContactParameters` into `PairProperties` for the chosen `Laws`."""
    young = 1.0 / (
        (1.0 - a.poisson_ratio**2) / a.young_modulus + (1.0 - b.poisson_ratio**2) / b.young_modulus
    )
    shear = 1.0 / (
        (2.0 - a.poisson_ratio) / a.shear_modulus + (2.0 - b.poisson_ratio) / b.shear_modulus
    )
    dashpot = thornton_law if laws.damping == "thornton" else tsuji_law
    strength = {
        "none": 0.0,
        "sjkr": contact.cohesion_energy_density,
        "jkr": contact.surface_energy,
        "liquid_bridge": contact.surface_tension,
    }[laws.cohesion]
    wet = laws.cohesion == "liquid_bridge" and contact.liquid_volume_fraction > 0.0
    liquid = contact.liquid_volume_fraction if wet else 1.0
    return PairProperties(
        young=young,
        shear=shear,
        damping=dashpot.factor(contact.restitution),
        friction=contact.static_friction,
        rolling=contact.rolling_friction,
        cohesion=strength if laws.cohesion != "liquid_bridge" or wet else 0.0,
        wetting=math.cos(contact.contact_angle),
        liquid=liquid,
        bridge_reach=bridge_law.reach(liquid, contact.contact_angle) if wet else 0.0,
        viscous_time=contact.viscous_time,
        yield_pressure=contact.yield_pressure if laws.damping == "plastic" else 1.0,
        friction_exponent=contact.friction_exponent,
        friction_reference=contact.friction_reference,
        rolling_stiffness=contact.rolling_stiffness,
        rolling_damping=contact.rolling_damping,
        rolling_limit=elastic_plastic_law.limit(contact.rolling_damping),
    )


def attraction_reach(codes, properties, radius):
    """Largest gap [m] at which this pair of materials still attracts, for grains up to radius [m]."""
    if codes.cohesion == JKR and properties.cohesion > 0.0:
        return jkr_law.reach.py_func(properties, radius)
    if codes.cohesion == LIQUID_BRIDGE:
        return radius * properties.bridge_reach
    return 0.0


__all__ = [
    "ContactParameters",
    "Laws",
    "Material",
    "attraction_reach",
    "pair_properties",
    "plastic_law",
]
