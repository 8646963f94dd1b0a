"""Section 1.2: the scaling statements, held against dimensional analysis
(`calibration.chain.scaling.dimensions`)."""

from itertools import product

import numpy as np

from calibration.chain.scaling import dimensions
from paper.audit.evaluate import Cells, Found, Given, cells, check
from paper.audit.paper import Claim, Paper

RULE = dimensions.PAPER_RULE.held
REAL_GRAVITY = dimensions.GRAVITY_RULE.held


@check("eq4.independent")
def independent(paper: Paper, claim: Claim) -> Given:
    return dimensions.independent(["length", "mass", "density"])


@check("eq4.mass", "eq5.mass")
def mass(paper: Paper, claim: Claim) -> Given:
    return int(dimensions.exponent("mass", {"length": 1, "density": 0}))


@check("eq6.force", "eq8.modulus", "section121.stiffness")
def exponent(paper: Paper, claim: Claim) -> Given:
    return int(dimensions.exponent(claim.part, RULE))


@check("eq2.weight")
def weight(paper: Paper, claim: Claim) -> Given:
    settings = dimensions.settings_of(dimensions.PAPER_RULE, ("acceleration",))
    table = dimensions.group_exponents(settings)
    needed = dimensions.exponent("acceleration", RULE)
    names = {"broken": ", ".join(table.group[~table.kept]), "needed": needed}
    return Found(int(dimensions.exponent("force", REAL_GRAVITY)), names=names)


@check("section121.modulus")
def modulus_adapts(paper: Paper, claim: Claim) -> Given:
    value = "adapts" if dimensions.exponent("modulus", RULE) else "is unchanged"
    return Found(value, names={"power": dimensions.exponent("modulus", REAL_GRAVITY)})


def _groups(paper):
    table = paper.text("dimensionless_groups", "group", "quantity", "exponent")
    powers = paper.numbers("dimensionless_groups", "exponent").exponent
    found = {}
    for group, quantity, power in zip(table.group, table.quantity, powers, strict=True):
        found.setdefault(group, {})[quantity] = power
    return found


def _needed_exponent(powers, quantity):
    """Exponent of the radius with which `quantity` must go for the group to keep its value."""
    rest = sum(power * RULE[q] for q, power in powers.items() if q != quantity)
    return -rest / powers[quantity]


@cells
def dimensionless(paper: Paper) -> Cells:
    for group, powers in _groups(paper).items():
        total = [sum(p * dimensions.DIMENSIONS[q][i] for q, p in powers.items()) for i in range(3)]
        value = " ".join(f"{t:g}" for t in total)
        yield "eq15.{group}", "0 0 0", Found(value, names={"group": group})


@check("section122.stiffness", "section122.damping")
def invariant_ratio(paper: Paper, claim: Claim) -> Given:
    group, quantity = {
        "stiffness": ("pi2", "stiffness"),
        "damping": ("pi3", "damping_coefficient"),
    }[claim.part]
    power = _needed_exponent(_groups(paper)[group], quantity)
    names = {"group": group, "quantity": quantity.replace("_", " ")}
    return Found(power, exact=True, names=names)


@check("section122.restitution")
def restitution(paper: Paper, claim: Claim) -> Given:
    groups = _groups(paper)
    k = _needed_exponent(groups["pi2"], "stiffness")
    c = _needed_exponent(groups["pi3"], "damping_coefficient")
    ratio = dimensions.damping_ratio_exponent(k, c, float(dimensions.exponent("mass", RULE)))
    return Found(float(ratio), exact=True, names={"damping": c, "ratio": ratio})


@check("eq10.mass", "eq11.radius", "eq14.terms")
def identity(paper: Paper, claim: Claim) -> Given:
    """Whether both sides of an equation are equal for spheres of radii R and `ratio` R: the
    effective mass and radius, and Eq. 9 in the dimensionless quantities of Eq. 12."""
    radius, density, stiffness, damping, speed = 1e-3, 1210.0, 800.0, 0.01, 1.7
    sphere, same = 4 / 3 * np.pi * density * radius**3, []
    for ratio in (0.5, 1.0, 2.0, 4.0):
        printed = 4 * np.pi * radius**3 * density * ratio**3 / (3 * (1 + ratio**3))
        mass = sphere * ratio**3 / (1 + ratio**3)
        terms = np.array([mass * speed**2 / radius, stiffness * radius, damping * speed])
        sides = {
            "mass": (printed, 1 / (1 / sphere + 1 / (sphere * ratio**3))),
            "radius": (radius * ratio / (1 + ratio), 1 / (1 / radius + 1 / (ratio * radius))),
            "terms": (
                [
                    4 * np.pi * ratio**3 / (3 * (1 + ratio**3)),
                    stiffness / (radius * density * speed**2),
                    damping / (radius**2 * density * speed),
                ],
                terms / (radius**2 * density * speed**2),
            ),
        }
        left, right = map(np.asarray, sides[claim.part])
        same.append(np.allclose(left, right, rtol=1e-12, atol=0.0))
    return "equal" if all(same) else "not equal"


@check("eq9.signs")
def contact_signs(paper: Paper, claim: Claim) -> Given:
    """The signs with which m x'' = +-k x +-c x' oscillates and decays (m = k = 1, weak damping)."""
    signs = {1: "+", -1: "-"}
    return " ".join(
        f"{signs[k]} {signs[c]}"
        for k, c in product((1, -1), repeat=2)
        if np.linalg.eigvals(np.array([[0, 1], [k, 0.1 * c]])).real.max() < 0
    )
