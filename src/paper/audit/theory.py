"""Section 1.2: the scaling statements, held against dimensional analysis
(`calibration.statistics.dimensions`)."""

from fractions import Fraction
from itertools import product

import numpy as np

from calibration.statistics import dimensions
from paper.audit.paper import Cells, Claims, Found

RULE = dimensions.PAPER_RULE
REAL_GRAVITY = dimensions.GRAVITY_RULE
FIXED = {"stiffness": ("pi2", "stiffness"), "damping": ("pi3", "damping_coefficient")}
"""Second part of a claim's id: group of Eq. 15 and quantity that it fixes."""


def _power(quantity, held=RULE):
    return int(dimensions.exponent(quantity, held))


def _weight(paper, claim):
    table = dimensions.group_exponents(dimensions.exponents(RULE) | {"acceleration": Fraction(0)})
    needed = dimensions.exponent("acceleration", RULE)
    broken = ", ".join(table.group[~table.kept])
    return Found(_power("force", REAL_GRAVITY), broken=broken, needed=needed)


def _groups(paper):
    """{dimensionless group: {quantity: its exponent}}."""
    table = paper.text("dimensionless_groups", "group", "quantity")
    powers = paper.numbers("dimensionless_groups", "exponent").exponent
    own = (rows.assign(power=powers).set_index("quantity") for _, rows in table.groupby("group"))
    return {rows.group.iloc[0]: rows.power.to_dict() for rows in own}


def _needed(paper, group, quantity):
    """Exponent of the radius with which `quantity` must go for the group to keep its value."""
    powers = _groups(paper)[group]
    rest = sum(power * RULE[q] for q, power in powers.items() if q != quantity)
    return -rest / powers[quantity]


def _dimensions(paper, row):
    powers = _groups(paper)[row["group"]].items()
    total = (sum(p * dimensions.DIMENSIONS[q][i] for q, p in powers) for i in range(3))
    return " ".join(f"{t:g}" for t in total)


def _ratio(paper, claim):
    """How a quantity must go with the radius for a group of Eq. 15 to stay as it is."""
    group, quantity = FIXED[claim.part]
    shown = quantity.replace("_", " ")
    return Found(_needed(paper, *FIXED[claim.part]), exact=True, group=group, quantity=shown)


def _restitution(paper, claim):
    k, c = (_needed(paper, *of) for of in FIXED.values())
    # of c / (2 sqrt(k m)), which alone sets the restitution of a linear contact
    ratio = Fraction(c) - (Fraction(k) + dimensions.exponent("mass", RULE)) / 2
    return Found(float(ratio), exact=True, damping=c, ratio=ratio)


def _identity(paper, claim):
    """Return whether both sides of an equation are equal for spheres of radii R and `ratio` R: the
    effective mass and radius, and Eq. 9 in the dimensionless quantities of Eq. 12."""
    radius, density, stiffness, damping, speed = 1e-3, 1210.0, 800.0, 0.01, 1.7
    ratio, one = np.array([0.5, 1.0, 2.0, 4.0]), np.ones(4)
    cube, sphere = ratio**3, 4 / 3 * np.pi * density * radius**3
    number = 4 * np.pi * cube / (3 * (1 + cube))
    mass = radius**3 * density * number
    force = sphere * cube / (1 + cube) * speed**2 / radius
    terms = [force, stiffness * radius * one, damping * speed * one]
    pi2, pi3 = stiffness / (radius * density * speed**2), damping / (radius**2 * density * speed)
    numbers = [number, pi2 * one, pi3 * one]
    left, right = {
        "mass": (mass, 1 / (1 / sphere + 1 / (sphere * cube))),
        "radius": (radius * ratio / (1 + ratio), 1 / (1 / radius + 1 / (ratio * radius))),
        "terms": (numbers, np.array(terms) / (radius**2 * density * speed**2)),
    }[claim.part]
    return "equal" if np.allclose(left, right, rtol=1e-12, atol=0.0) else "not equal"


def _contact_signs(paper, claim):
    """The signs with which m x'' = +-k x +-c x' oscillates and decays (m = k = 1, weak damping)."""
    signs = {1: "+", -1: "-"}
    return " ".join(
        f"{signs[k]} {signs[c]}"
        for k, c in product((1, -1), repeat=2)
        if np.linalg.eigvals(np.array([[0, 1], [k, 0.1 * c]])).real.max() < 0
    )


CLAIMS: Claims = {
    "eq4.independent": lambda *_: int(
        np.linalg.matrix_rank([dimensions.DIMENSIONS[q] for q in ("length", "mass", "density")])
    ),
    "eq4.mass eq5.mass": lambda paper, _: _power("mass", {"length": 1, "density": 0}),
    "eq6.force eq8.modulus section121.stiffness": lambda paper, claim: _power(claim.part),
    "eq2.weight": _weight,
    "section121.modulus": lambda *_: Found(
        "adapts" if dimensions.exponent("modulus", RULE) else "is unchanged",
        power=dimensions.exponent("modulus", REAL_GRAVITY),
    ),
    "section122.stiffness section122.damping": _ratio,
    "section122.restitution": _restitution,
    "eq10.mass eq11.radius eq14.terms": _identity,
    "eq9.signs": _contact_signs,
}
CELLS: Cells = {
    "eq15.{group}": (
        lambda paper: [{"group": group, "implied": "0 0 0"} for group in _groups(paper)],
        "implied", _dimensions,
    )
}  # fmt: skip
