"""What grains do, in closed form or by scipy: true rebounds [mm], sliding angles [deg] and shear
stresses [kPa].

A law is a function of the levers and of one number `k`. Restitution and friction are factors over a
constant; a reading is changed in its own unit. A place is (slot, state) in the words of
docs/diagnosis.md; where two places are one function of the levers on every plan, both are right.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

G = 9.81
"""[m/s2]"""
SALT, AIR, VISCOSITY = 1210.0, 1.2, 1.8e-5
"""Density of the grains [kg/m3], of the air [kg/m3] and its viscosity [Pa s]."""

Levers = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Law:
    """One effect of nature.

    name: in words. experiment: drop, tilt or shear. places: the (slot, state) that are right. k: a
    usual strength. factor(x, k): what multiplies the coefficient, (n,). reading(x, true, k): the
    reading in its unit, (n,), where the coefficient is constant. names: mechanisms of the catalogue
    that are this effect; empty where none is.
    """

    name: str
    experiment: str
    places: tuple[tuple[str, tuple[str, ...]], ...]
    k: float
    factor: Callable[[Levers, float], np.ndarray] | None = None
    reading: Callable[[Levers, np.ndarray, float], np.ndarray] | None = None
    names: tuple[str, ...] = ()


def speed(x: Levers) -> np.ndarray:
    """Impact speed [m/s] after a fall without air."""
    return np.sqrt(2e-3 * G * x["drop_height_mm"])


def size(x: Levers) -> np.ndarray:
    """Diameter [mm]."""
    return x["particle_diameter_mm"]


def value(
    laws: tuple[tuple[Law, float], ...], experiment: str, x: Levers, constant: float
) -> np.ndarray:
    """True readings (n,) of an experiment: rebounds [mm], angles [deg] or stresses [kPa].

    constant: the restitution, or the friction, without any law.
    """
    own = [(law, k) for law, k in laws if law.experiment == experiment]
    coefficient = constant * np.ones(len(next(iter(x.values()))))
    for law, k in own:
        if law.factor:
            coefficient = coefficient * law.factor(x, k)
    if experiment == "drop":
        true = np.clip(coefficient, 1e-3, 1.0) ** 2 * x["drop_height_mm"]
    elif experiment == "shear":
        true = coefficient * x["normal_stress_kPa"]
    else:
        true = np.degrees(np.arctan(coefficient))
    for law, k in own:
        if law.reading:
            true = law.reading(x, true, k)
    return true


def drag_coefficient(reynolds: float) -> float:
    """Of a sphere (Schiller and Naumann 1935; Newton's 0.44 above 1,000)."""
    re = max(reynolds, 1e-9)
    return 24.0 / re * (1.0 + 0.15 * re**0.687) if re < 1000.0 else 0.44


@lru_cache(maxsize=4096)
def rebound_in_air(height: float, diameter: float, restitution: float, air: float) -> float:
    """Rebound [m] of a sphere [m] from a height [m] against the drag of air of so many times the
    usual density."""
    mass = np.pi / 6.0 * SALT * diameter**3

    def drag(v):
        re = AIR * abs(v) * diameter / VISCOSITY
        area = np.pi / 4.0 * diameter**2
        return 0.5 * air * AIR * drag_coefficient(re) * area * v * abs(v) / mass

    def move(_, y):
        return [y[1], -G - drag(y[1])]

    def ground(_, y):
        return y[0]

    def apex(_, y):
        return y[1]

    for event in (ground, apex):
        vars(event).update(terminal=True, direction=-1)
    exact = {"rtol": 1e-9, "atol": 1e-12}
    fall = solve_ivp(move, (0, 5), [height, 0.0], events=ground, **exact)
    up = restitution * abs(fall.y[1, -1])
    return float(solve_ivp(move, (0, 5), [0.0, up], events=apex, **exact).y[0, -1])


def _in_air(x, true, k):
    e = np.sqrt(true / x["drop_height_mm"])
    flights = zip(1e-3 * x["drop_height_mm"], 1e-3 * size(x), e, strict=True)
    return np.array([1e3 * rebound_in_air(*map(float, f), float(k)) for f in flights])


def _yielding(x, k):
    """Constant up to k [m/s], then falling as v^(-1/4) (Johnson 1985, Contact Mechanics, 11.5)."""
    return np.minimum(1.0, (speed(x) / k) ** -0.25)


def _sticking(x, k):
    """sqrt(1 - (k/v)^2): each impact pays the same energy per mass (Thornton and Ning 1998)."""
    return np.sqrt(np.clip(1.0 - (k / speed(x)) ** 2, 1e-4, 1.0))


def _slipped(x, true, k):
    """The slide is seen when it has gone k [mm]. Tilted at w beyond the angle a, where it starts,
    the plane pulls with g w t / cos(a), so that k = g w t^3 / (6 cos(a))."""
    w = np.radians(x["tilt_rate_deg_s"])
    late = np.cbrt(6e-3 * k * np.cos(np.radians(true)) * w**2 / G)
    return true + np.degrees(late)


SPEED, SIZE = ("restitution", ("speed",)), ("restitution", ("size",))
LENGTH = ("reading", ())
OF_SIZE = (("friction", ("size",)), ("friction", ("load",)), ("attraction", ("size",)))
OF_RATE = (("friction", ("rate",)), ("reading", ("rate",)))
OF_INTERCEPT = (("attraction", ()), ("load", ()), ("reading", ()))


def of_column(column: str, with_size: bool = False) -> tuple:
    """Places of a law of a further column, alone or with the size, whatever the slot is called."""
    slots = ("restitution", "friction", "reading", "attraction")
    return tuple((slot, (column, "size") if with_size else (column,)) for slot in slots)


def power_of_speed(exponent: float) -> Law:
    """Restitution as v^-exponent; a quarter, and what cannot be told from it, is plastic yield."""
    names = ("plastic_restitution",) if 0.2 <= exponent <= 0.3 else ()
    return Law(f"v^-{exponent:g}", "drop", (SPEED,), exponent,
               lambda x, k: (speed(x) / 1.5) ** -k, names=names)  # fmt: skip


LAWS = (
    *(power_of_speed(p) for p in (0.1, 0.2, 0.25, 0.3, 0.45, 0.6)),
    # sharper than a sphere yields, and flatter than a viscous one of that restitution: no names
    Law("yielding above a speed", "drop", (SPEED,), 1.2, _yielding),
    Law("fifth root of speed", "drop", (SPEED,), 0.2, lambda x, k: 1.0 - k * speed(x) ** 0.2),
    Law("rises with speed", "drop", (SPEED,), 0.12, lambda x, k: (speed(x) / 1.5) ** k),
    Law("sticking speed", "drop", (SPEED, LENGTH), 0.35, _sticking),
    Law("power of size", "drop", (SIZE,), 0.1, lambda x, k: (size(x) / 2.0) ** k),
    Law("rebound 14 % lower at 4 mm", "drop", (SIZE,), 0.14,
        lambda x, k: np.where(size(x) > 3.5, np.sqrt(1.0 - k), 1.0)),
    Law("film on the grains below 2 mm", "drop", (SIZE,), 0.06,
        lambda x, k: np.where(size(x) > 2.0, 1.0, 1.0 - k)),
    Law("film of liquid", "drop", (("restitution", ("speed", "size")),), 0.25,
        lambda x, k: 1.0 - k / (speed(x) * size(x))),
    Law("air", "drop", (("drag", ("speed", "size")),), 1.0, None, _in_air, ("air_drag",)),
    Law("pull of the plate, drops", "drop", (("attraction", ("size",)),), 2.0, None,
        lambda x, true, k: np.maximum(true - k / size(x), 0.01),
        ("wall_adhesion", "liquid_bridge")),
    Law("wrong zero of the rebound", "drop", (LENGTH, SPEED), 2.5, None,
        lambda x, true, k: true + k),
    Law("top of the grain is read", "drop", (("reading", ("size",)),), 1.0, None,
        lambda x, true, k: true + k * size(x)),
    Law("apex between two frames", "drop", (("reading", ("interval",)),), 1.0, None,
        lambda x, true, k: np.maximum(
            true - k * 1e3 * G * x["output_interval_s"] ** 2 / 24.0, 0.01),
        ("apex_sampling",)),
    Law("humidity, drops", "drop", of_column("humidity_percent"), 0.15,
        lambda x, k: 1.0 - k * (x["humidity_percent"] - 30.0) / 50.0),
    Law("temperature, drops", "drop", of_column("temperature_C"), 0.12,
        lambda x, k: np.exp(-k * (x["temperature_C"] - 20.0) / 20.0)),
    Law("wear by impacts", "drop", of_column("impact_number"), 0.1,
        lambda x, k: 1.0 - k * np.log1p(x["impact_number"] / 100.0)),
    Law("wear of large grains alone", "drop", of_column("impact_number", with_size=True), 0.1,
        lambda x, k: 1.0 - k * np.where(size(x) > 1.9, x["impact_number"] / 3000.0, 0.0)),
    Law("late hand", "tilt", OF_RATE, 0.15, None,
        lambda x, true, k: true + k * x["tilt_rate_deg_s"], ("tilt_detection_lag",)),
    Law("seen after a slip", "tilt", OF_RATE, 1.0, None, _slipped, ("tilt_detection_lag",)),
    Law("friction over log of the rate", "tilt", OF_RATE, 0.05,
        lambda x, k: 1.0 + k * np.log(x["tilt_rate_deg_s"] / 6.0)),
    Law("friction over the load", "tilt", OF_SIZE, 0.04, lambda x, k: (size(x) / 2.0) ** (-3.0 * k),
        names=("stress_dependent_friction",)),
    Law("friction rises with size", "tilt", OF_SIZE, 0.1, lambda x, k: (size(x) / 2.0) ** k),
    # the pull ~ d over the weight ~ d^3 (JKR), with and without a mass that each grain carries
    Law("pull of the plate, slides", "tilt", OF_SIZE, 0.15, lambda x, k: 1.0 + k / size(x) ** 2,
        names=("wall_adhesion",)),
    Law("pull, and an added mass", "tilt", (*OF_SIZE, ("mass", ("size",))), 0.3,
        lambda x, k: 1.0 + k * size(x) / (size(x) ** 3 + 4.0)),
    Law("humidity, slides", "tilt", of_column("humidity_percent"), 0.15,
        lambda x, k: 1.0 + k * (x["humidity_percent"] - 30.0) / 50.0),
    # an intercept of the locus is a pull as well as a load that was not counted
    Law("cohesion", "shear", OF_INTERCEPT, 0.15, None, lambda x, true, k: true + k,
        ("cohesion", "uncounted_load")),
    Law("lid that was not weighed", "shear", OF_INTERCEPT, 0.25, None,
        lambda x, true, k: true * (1.0 + k / x["normal_stress_kPa"]),
        ("cohesion", "uncounted_load")),
    Law("friction falls with the load", "shear", (("friction", ("load",)),), 0.12,
        lambda x, k: (x["normal_stress_kPa"] / 2.0) ** -k, names=("stress_dependent_friction",)),
)  # fmt: skip
BY_NAME = {law.name: law for law in LAWS}
