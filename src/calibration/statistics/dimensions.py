"""Dimensional analysis of a particle model enlarged by the length factor h.

Every quantity q of the enlarged model is h**a times the original's. Dimensions alone decide which
exponents are free. A quantity of the dimension M^m L^l T^t has the exponent m a_M + l a_L + t a_T.
So three held quantities of independent dimensions fix all others.

Sources: Y. T. Feng, K. Han, D. R. J. Owen and J. Loughran, Engineering Computations 26 (2009)
599-609, for the laws; the paper, Eq. 2 to 8 and 15.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError

DIMENSIONS: dict[str, tuple[int, int, int]] = {
    # quantity: powers of mass, length, time
    "mass": (1, 0, 0),
    "length": (0, 1, 0),
    "time": (0, 0, 1),
    "rig_length": (0, 1, 0),
    "density": (1, -3, 0),
    "velocity": (0, 1, -1),
    "acceleration": (0, 1, -2),
    "force": (1, 1, -2),
    "energy": (1, 2, -2),
    "modulus": (1, -1, -2),
    "stress": (1, -1, -2),
    "cohesion_energy_density": (1, -1, -2),
    "stiffness": (1, 0, -2),
    "damping_coefficient": (1, 0, -1),
    "surface_energy": (1, 0, -2),
    "viscosity": (1, -1, -1),
    "angular_velocity": (0, 0, -1),
    "moment_of_inertia": (1, 2, 0),
    "torque": (1, 2, -2),
    "rolling_length": (0, 1, 0),
    "angle": (0, 0, 0),
    "friction": (0, 0, 0),
    "restitution": (0, 0, 0),
}
"""Powers of mass, length and time of every quantity known; `rig_length` is the apparatus, `length`
the particle."""

MOST = 60
"""Largest denominator of an exponent."""

GROUPS: dict[str, dict[str, float]] = {
    # dimensionless group: powers of its quantities
    "Froude number v2/(g L)": {"velocity": 2, "acceleration": -1, "length": -1},
    "relative overlap rho v2/E": {"density": 1, "velocity": 2, "modulus": -1},
    "weight to stiffness rho g L/E": {"density": 1, "acceleration": 1, "length": 1, "modulus": -1},
    "Bond number gamma/(rho g L2)": {
        "surface_energy": 1,
        "density": -1,
        "acceleration": -1,
        "length": -2,
    },
    "adhesion to stiffness gamma/(E L)": {"surface_energy": 1, "modulus": -1, "length": -1},
    "cohesion number C/(rho g L)": {
        "cohesion_energy_density": 1,
        "density": -1,
        "acceleration": -1,
        "length": -1,
    },
    "rolling-resistance number l_r/L": {"rolling_length": 1, "length": -1},
    "particle to rig L/D": {"length": 1, "rig_length": -1},
}
"""Dimensionless groups that a model must keep to behave alike, as powers of the quantities in
`DIMENSIONS`."""


class ScalingError(CalibrationError):
    """A scaling rule that does not fix what is asked of it."""


class OverdeterminedError(ScalingError):
    """Held quantities whose exponents contradict each other; `conflict` names the smallest such
    set."""

    def __init__(self, conflict: Mapping[str, Fraction], demanded: Fraction):
        self.conflict, self.demanded = dict(conflict), demanded
        *others, last = self.conflict
        said = ", ".join(f"{q} ~ h^{a}" for q, a in self.conflict.items())
        super().__init__(
            f"the held quantities contradict each other: {said}; given "
            f"{', '.join(others) or 'no other'}, {last} must go as h^{demanded}"
        )


class UnderdeterminedError(ScalingError):
    """A quantity whose exponent the held ones leave open; `quantity` and `held` name them."""

    def __init__(self, quantity: str, held: Mapping[str, Fraction]):
        self.quantity, self.held = quantity, dict(held)
        super().__init__(
            f"holding {', '.join(held) or 'nothing'} leaves the exponent of {quantity} open"
        )


@dataclass(frozen=True)
class Rule:
    """A scaling rule: `held` maps quantities to their exponents of h, `source` says where it is
    stated."""

    name: str
    held: Mapping[str, float]
    source: str


PAPER_RULE = Rule(
    "paper",
    {"length": 1, "density": 0, "velocity": 0},
    "the paper, 1.2.2: density and velocity are invariant",
)
GRAVITY_RULE = Rule(
    "gravity-consistent",
    {"length": 1, "density": 0, "acceleration": 0},
    "Froude scaling: density and gravity are invariant",
)
RULES = {rule.name: rule for rule in (PAPER_RULE, GRAVITY_RULE)}


def exponent(quantity: str, held: Mapping[str, float]) -> Fraction:
    """Exponent of the length factor h in the factor of `quantity`.

    Parameters
    ----------
    quantity : key of `DIMENSIONS`
    held : the quantities held, each with its exponent of h (0: unchanged; length 1: enlarged h
    times)

    Raises
    ------
    OverdeterminedError : the held exponents contradict each other
    UnderdeterminedError : the held quantities do not fix this one
    """
    exact = {q: Fraction(a).limit_denominator(MOST) for q, a in held.items()}
    _check_consistent(exact)
    found = _exponent(quantity, exact)
    if found is None:
        raise UnderdeterminedError(quantity, exact)
    return found


def exponents(held: Mapping[str, float]) -> dict[str, Fraction]:
    """Exponent of h of every quantity in `DIMENSIONS`; raises as `exponent` does."""
    return {quantity: exponent(quantity, held) for quantity in DIMENSIONS}


def factors(held: Mapping[str, float], h: float) -> dict[str, float]:
    """Factor h**exponent of every quantity in `DIMENSIONS` for the length factor `h` > 0; raises as
    `exponent` does."""
    return {quantity: float(h) ** float(a) for quantity, a in exponents(held).items()}


def independent(quantities: list[str]) -> int:
    """Number of independent dimensions among `quantities` (3 are needed to fix a mechanical
    model)."""
    return int(np.linalg.matrix_rank([DIMENSIONS[q] for q in quantities])) if quantities else 0


def _check_consistent(held):
    """Raise `OverdeterminedError`, naming the smallest set of `held` quantities that contradict
    each other."""
    for size in range(1, min(len(held), 4) + 1):  # four quantities always depend on one another
        for subset in combinations(held, size):
            *others, last = subset
            demanded = _exponent(last, {q: held[q] for q in others})
            if demanded not in (None, held[last]):
                raise OverdeterminedError({q: held[q] for q in subset}, demanded)


def group_exponents(settings: Mapping[str, float | Fraction]) -> pd.DataFrame:
    """Which dimensionless groups an enlarged model keeps.

    Parameters
    ----------
    settings : exponent of h actually given to each quantity a group of `GROUPS` needs (see
    `settings_of`)

    Returns
    -------
    DataFrame with columns group, exponent (of h, in the group), kept (exponent is 0)
    """
    rows = []
    for group, powers in GROUPS.items():
        a = sum(
            Fraction(power) * Fraction(settings[q]).limit_denominator(MOST)
            for q, power in powers.items()
        )
        rows.append({"group": group, "exponent": a, "kept": a == 0})
    return pd.DataFrame(rows)


def settings_of(rule: Rule, unscaled: tuple[str, ...] = ()) -> dict[str, Fraction]:
    """Exponents a simulation is set up with: the rule's, save that each quantity in `unscaled`
    keeps its value.

    Real gravity, a measured surface energy or the laboratory's funnel are not scaled because a rule
    asks for it: naming them in `unscaled` shows with `group_exponents` what that breaks.
    """
    return exponents(rule.held) | dict.fromkeys(unscaled, Fraction(0))


def _exponent(quantity: str, held: Mapping[str, Fraction]) -> Fraction | None:
    """Exponent of a quantity by that product of the held ones which has its dimension; None where
    no product has."""
    target = np.array(DIMENSIONS[quantity], float)
    columns = np.array([DIMENSIONS[q] for q in held], float).reshape(-1, 3).T
    powers = np.linalg.lstsq(columns, target)[0]
    if not np.allclose(columns @ powers, target):
        return None
    return Fraction(float(powers @ np.array(list(held.values()), float))).limit_denominator(MOST)
