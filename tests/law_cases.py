"""Every law of the catalogue as a case for tests, from what its file declares: laws that it can be
combined with, and values for its parameters. A law that is added is tried without another line."""

from dataclasses import replace
from functools import cache
from itertools import combinations, product

from dem.contact.catalogue import LAWS, SLOTS, every_law
from dem.contact.law import Grain
from dem.contact.registry import Laws, Material
from dem.units import in_ascii, unit_of

SALT = Grain(Material(1210.0, 1e7, 0.25), 1e-3)

USUAL = {
    "N": (1e-4, 3), "N/m": (100.0, 2), "J/m2": (0.02, 2), "J/m3": (1e4, 1), "Pa": (2e5, 1),
    "kPa": (200.0, 1), "Pa s": (1e-5, 1.5), "m/s": (0.1, 0.5), "mm/s": (100.0, 0.5),
    "rad/s": (10.0, -0.5), "deg/s": (500.0, -0.5), "1/s": (100.0, -0.5), "s": (1e-6, 0.5),
    "mm": (0.1, 1), "kg": (1e-6, 3), "kg/m3": (1000.0, 0), "kg/s": (1e-3, 2.5),
    "g/s": (1.0, 2.5), "deg": (20.0, 0), "1": (0.2, 0),
}  # fmt: skip
"""Unit of a parameter -> a value that grains of salt feel, and the power of h by which it goes:
lengths and stresses go as h, times as its root."""
FELT = {
    "normal_stiffness_N_m": (500.0, 2), "yield_velocity_m_s": (0.01, 0.5),
    "surface_tension_N_m": (0.07, 2), "liquid_volume_fraction": (0.01, 0),
    "friction_reference_force_N": (1e-3, 3),
    "friction_curve_low": (1e-3, 3), "friction_curve_ratio": (100.0, 0),
    "friction_curve_1": (1.5, 0), "restitution_curve_low": (0.1, 0.5),
    "restitution_curve_5": (0.6, 0),
}  # fmt: skip
"""The same by key, where the default or the usual value of the unit would not be felt, or alone."""

ROOM = 0.5
"""How far a value stands inside an open end of its range, over the end's size or 1."""


@cache
def alone(**others):
    """[(name, `Laws`)] with each law of a contact once, beside the defaults and `others` {slot:
    name}; as few other laws are changed as it needs. Equal choices come once."""
    first = replace(Laws(), **others)
    found = {}
    for law in every_law():
        if law.slot != "drag":  # which is no part of a contact
            found.setdefault(_with(law, first), f"{law.slot}-{law.name}")
    return [(name, laws) for laws, name in found.items()]


def _with(law, first):
    """The choice with a law that differs in the fewest slots from the first one."""
    base = replace(first, **{law.slot: law.name})
    rest = [slot for slot in SLOTS if slot != law.slot]
    for count in range(len(rest) + 1):
        for slots in combinations(rest, count):
            for names in product(*(LAWS[slot] for slot in slots)):
                laws = replace(base, **dict(zip(slots, names, strict=True)))
                if not list(laws.clashes()):
                    return laws
    raise AssertionError(f"{law.slot} {law.name} can be combined with no laws")


def values(laws, h=1.0, grain=SALT):
    """{name in `ContactParameters`: SI value} of the parameters of chosen laws: the default, else
    what is usual of the unit, inside the range; for grains h times as large."""
    grain = Grain(
        replace(grain.material, shear_modulus=grain.material.shear_modulus * h), grain.radius * h
    )
    return {
        p.name: p.to_si(_value(p, h), grain)
        for law in laws.chosen()
        for p in law.parameters
        if law.slot != "drag"
    }


def _value(parameter, h):
    value, power = FELT.get(parameter.key) or USUAL[in_ascii(unit_of(parameter.key))]
    if parameter.key not in FELT and parameter.default is not None:
        value = parameter.default
    limits = parameter.limits
    low, high = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    if high is not None and value >= high:
        value = high - ROOM * (abs(high) or 1.0)
    if low is not None and value <= low and parameter.default is None:
        value = low + ROOM * (abs(low) or 1.0) if high is None else 0.5 * (low + high)
    return value * h**power
