"""What grains do, in closed form or by scipy: true rebounds [mm], sliding angles [deg] and shear
stresses [kPa].

A law is a line of `laws.csv`: a formula of the levers and of one number `k`. Restitution and
friction are factors over a constant; a reading is changed in its own unit. A place is (slot, state)
in the words of docs/diagnosis.md; where two places are one function of the levers on every plan,
both are right.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

G = 9.81
"""[m/s2]"""
SALT, AIR, VISCOSITY = 1210.0, 1.2, 1.8e-5
"""Density of the grains [kg/m3], of the air [kg/m3] and its viscosity [Pa s]."""

Levers = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Law:
    """One effect of nature, as a line of laws.csv has it.

    experiment: drop, tilt or shear. places: the (slot, state) that are right; in the file a slot
    and the parts of its state. k: a usual strength. factor: formula of what multiplies the
    coefficient. reading: formula of the reading in its unit, where the coefficient is constant.
    names: mechanisms of the catalogue that are this effect; empty where none is.
    """

    name: str
    experiment: str
    places: tuple[tuple[str, tuple[str, ...]], ...]
    k: float
    factor: str
    reading: str
    names: tuple[str, ...]


def read_laws() -> dict[str, Law]:
    """Return {name: law} of laws.csv."""
    table = pd.read_csv(Path(__file__).with_name("laws.csv"), keep_default_na=False)
    laws = {}
    for r in table.itertuples():
        places = tuple((slot, tuple(state)) for slot, *state in map(str.split, r.places.split(";")))
        names = tuple(filter(None, r.names.split("; ")))
        laws[r.law] = Law(r.law, r.experiment, places, r.k, r.factor, r.reading, names)
    return laws


def evaluated(formula: str, x: Levers, k: float, true: np.ndarray | None = None) -> np.ndarray:
    """Return the value (n,) of an expression of numpy's functions and `in_air`, of the levers, of
    `speed` (the impact's after a fall without air [m/s]) and `size` (the diameter [mm]), of k and
    of the true reading."""
    names: dict[str, Any] = vars(np) | {"G": G, "in_air": in_air, "k": k, "true": true, **x}
    if "drop_height_mm" in x:
        names["speed"] = np.sqrt(2e-3 * G * x["drop_height_mm"])
    if "particle_diameter_mm" in x:
        names["size"] = x["particle_diameter_mm"]
    return eval(formula, names)


def value(laws: Sequence[Law], experiment: str, x: Levers, constant: float) -> np.ndarray:
    """True readings (n,) of an experiment: rebounds [mm], angles [deg] or stresses [kPa].

    constant: the restitution, or the friction, without any law.
    """
    own = [law for law in laws if law.experiment == experiment]
    coefficient = constant * np.ones(len(next(iter(x.values()))))
    for law in own:
        if law.factor:
            coefficient = coefficient * evaluated(law.factor, x, law.k)
    if experiment == "drop":
        true = np.clip(coefficient, 1e-3, 1.0) ** 2 * x["drop_height_mm"]
    elif experiment == "shear":
        true = coefficient * x["normal_stress_kPa"]
    else:
        true = np.degrees(np.arctan(coefficient))
    for law in own:
        if law.reading:
            true = evaluated(law.reading, x, law.k, true)
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

    def end(state, which):
        """The state where its height, or its speed, has fallen to zero."""

        def event(_, y):
            return y[which]

        vars(event).update(terminal=True, direction=-1)
        return solve_ivp(move, (0, 5), state, events=event, rtol=1e-9, atol=1e-12).y[:, -1]

    _, impact = end([height, 0.0], 0)
    return float(end([0.0, restitution * abs(impact)], 1)[0])


def in_air(height: np.ndarray, diameter: np.ndarray, true: np.ndarray, air: float) -> np.ndarray:
    """Return rebounds (n,) [mm] in air of what were rebounds `true` [mm] without it, of grains of a
    diameter [mm] that fell from a height [mm]."""
    flights = zip(1e-3 * height, 1e-3 * diameter, np.sqrt(true / height), strict=True)
    return np.array([1e3 * rebound_in_air(*map(float, f), float(air)) for f in flights])


BY_NAME = read_laws()
