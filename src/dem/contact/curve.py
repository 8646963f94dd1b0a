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
from typing import TYPE_CHECKING, Any

from dem.contact.law import Parameter
from dem.kernel.arithmetic import law, maximum, minimum, sqrt

if TYPE_CHECKING:
    from dem.contact.registry import ContactParameters


POINTS = 5
SHARES = range(1, POINTS + 1)
STEPS = POINTS - 1.0
TINY = 1e-30  # a state of nothing, as the load of a contact without force, has a logarithm


def declared(
    key: str,
    what: str,
    powers: Mapping[tuple[str, str], float],
    coefficient: Callable[[ContactParameters, float], float],
) -> dict[str, Any]:
    """Parameters, constants and values of a `Law` with a curve of `what`, as it declares them.

    powers: state with its unit -> its power unless given; coefficient: (contact, share) -> value of
    the coefficient there. key_d0 to key_d4: Newton's divided differences of the values over steps
    of 1; least, most: the values' ends; key_start, key_<state>: place in steps, a sum over the
    logarithms of the states.
    """
    states = [state for state, _ in powers]
    unit = " ".join(f"({unit})^{state}_power" for state, unit in powers)
    over = f"of {POINTS}, over that of the contact"
    smallest, largest = "state 1, the smallest of the curve", f"state {POINTS}, the largest of the"
    rows: list[Any] = [
        *((k, f"{what} at state {k} {over}", {"gt": 0}, 1.0, True) for k in SHARES),
        ("low", f"{smallest}: {unit}", {"gt": 0}, None, False, 1.0),
        ("ratio", f"{largest} curve, over state 1", {"gt": 1}, None, False, math.e),
    ]
    for (state, _), power in powers.items():
        meaning = f"power of the {state} in the state of the curve"
        rows.append((f"{state}_power", meaning, {"ge": -10, "le": 10}, power))
    constants = [f"d{k}" for k in range(POINTS)] + ["least", "most", "start", *states]

    def values(contact):
        given = {end: getattr(contact, f"{key}_{end}") for end, *_ in rows}
        found = [coefficient(contact, given[k]) for k in SHARES]
        out, ends = [], [min(found), max(found)]
        for k in range(POINTS):
            out.append(found[0] / math.factorial(k))
            found = [after - before for before, after in pairwise(found)]
        step = math.log(given["ratio"]) / STEPS
        out += [*ends, -math.log(given["low"]) / step]
        out += [given[f"{state}_power"] / step for state in states]
        return {f"{key}_{name}": x for name, x in zip(constants, out, strict=True)}

    return {
        "parameters": tuple(Parameter(f"{key}_{end}", f"{key}_{end}", *row) for end, *row in rows),
        "constants": tuple(f"{key}_{name}" for name in constants),
        "values": values,
    }


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
