"""A law as a curve: a coefficient that is a free function of a state of the contact.

The state is a power product, such as (v / 1 m/s)^a (d / 1 mm)^b of speed and size. Over its
logarithm five states stand at equal steps, from the smallest to the largest that the curve knows.
At each the law has a share of the coefficient that the contact has. Between them the coefficient
runs along the polynomial of degree four through the five values (Newton's form). It is held between
the least and the largest of them, so that it stays positive; beyond the five states it is constant.
Five equal shares are the law without a curve, to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

from dem.contact.law import Parameter
from dem.kernel.arithmetic import maximum, minimum, sqrt
from dem.kernel.decorator import law

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters


POINTS = 5
STEPS = POINTS - 1.0
TINY = 1e-30  # a state of nothing, as the load of a contact without force, has a logarithm


def parameters(
    key: str, what: str, powers: Mapping[tuple[str, str], float]
) -> tuple[Parameter, ...]:
    """The `Parameter`s of a curve of `what`; powers: state with its unit -> its power unless
    given."""
    shares = [
        Parameter(
            key=f"{key}_{k}",
            name=f"{key}_{k}",
            meaning=f"{what} at state {k} of {POINTS}, over that of the contact",
            limits={"gt": 0},
            default=1.0,
            wall=True,
        )
        for k in range(1, POINTS + 1)
    ]
    states = " ".join(f"({unit})^{state}_power" for (state, unit) in powers)
    reach = (
        Parameter(
            key=f"{key}_low",
            name=f"{key}_low",
            meaning=f"state 1, the smallest of the curve: {states}",
            limits={"gt": 0},
            unset=1.0,
        ),
        Parameter(
            key=f"{key}_ratio",
            name=f"{key}_ratio",
            meaning=f"state {POINTS}, the largest of the curve, over state 1",
            limits={"gt": 1},
            unset=math.e,
        ),
    )
    return (
        *shares,
        *reach,
        *(
            Parameter(
                key=f"{key}_{state}_power",
                name=f"{key}_{state}_power",
                meaning=f"power of the {state} in the state of the curve",
                limits={"ge": -10, "le": 10},
                default=power,
            )
            for (state, _), power in powers.items()
        ),
    )


def constants(key: str, powers: Mapping[tuple[str, str], float]) -> tuple[str, ...]:
    """Names of what the kernels read: see `values`."""
    own = [f"{key}_d{k}" for k in range(POINTS)] + [f"{key}_least", f"{key}_most", f"{key}_start"]
    return (*own, *(f"{key}_{state}" for state, _ in powers))


def values(
    key: str,
    powers: Mapping[tuple[str, str], float],
    contact: ContactParameters,
    coefficient: Callable[[float], float],
) -> dict[str, float]:
    """{name: constant} of a curve; coefficient: share -> value of the coefficient there.

    key_d0 to key_d4: Newton's divided differences of the values over steps of 1; least, most: the
    values' ends; key_start, key_<state>: place in steps, a sum over the logarithms of the states.
    """
    shares = [getattr(contact, f"{key}_{k}") for k in range(1, POINTS + 1)]
    found = [coefficient(share) for share in shares]
    out = {f"{key}_least": min(found), f"{key}_most": max(found)}
    for k in range(POINTS):
        out[f"{key}_d{k}"] = found[0] / math.factorial(k)
        found = [after - before for before, after in pairwise(found)]
    step = math.log(getattr(contact, f"{key}_ratio")) / STEPS
    out[f"{key}_start"] = -math.log(getattr(contact, f"{key}_low")) / step
    for state, _ in powers:
        out[f"{key}_{state}"] = getattr(contact, f"{key}_{state}_power") / step
    return out


@law
def logarithm(state):
    """Natural logarithm of a state, to 3e-6 from 1e-14 to 1e14: 128 artanh((r - 1)/(r + 1)), r the
    64th root.

    Without a library's logarithm, whose call would take all contacts their registers.
    """
    root = sqrt(sqrt(sqrt(sqrt(sqrt(sqrt(maximum(state, TINY)))))))
    z = (root - 1.0) / (root + 1.0)
    q = z * z
    return 128.0 * z * (1.0 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9)))))


@law
def curve(place, differences, least, most):
    """The coefficient at a place in steps from state 1; differences: key_d0 to key_d4."""
    t = minimum(maximum(place, 0.0), STEPS)
    d = differences
    value = d[3] + (t - 3.0) * d[4]
    value = d[2] + (t - 2.0) * value
    value = d[1] + (t - 1.0) * value
    return minimum(maximum(d[0] + t * value, least), most)
