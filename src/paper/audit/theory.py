"""Section 1.2: the scaling statements, held against dimensional analysis
(`calibration.chain.scaling.dimensions`)."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from calibration.chain.scaling import dimensions
from paper.audit.paper import Claim, Paper
from paper.audit.verdict import Recomputed, claim_check, table_check

RULE = dimensions.PAPER_RULE.held
REAL_GRAVITY = dimensions.GRAVITY_RULE.held


@claim_check("eq4.independent")
def independent(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        dimensions.independent(["length", "mass", "density"]),
        disagrees="Mass is density times length cubed: the three fix two dimensions and leave time "
        "open. The factor of "
        "time must be stated; the paper's Eq. 6 and 8 need it to be h.",
    )


@claim_check("eq4.mass", "eq5.mass")
def mass(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        int(dimensions.exponent("mass", {"length": 1, "density": 0})),
        agrees="Follows from constant density.",
        disagrees="With the density unchanged the mass goes as the volume; Eq. 5 has it right.",
    )


@claim_check("eq6.force")
def force(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        int(dimensions.exponent("force", RULE)),
        agrees="Holds where velocity is kept, that is where time is scaled by h.",
    )


@claim_check("eq2.weight")
def weight(paper: Paper, claim: Claim) -> Recomputed:
    needed = dimensions.exponent("acceleration", RULE)
    return Recomputed(
        int(dimensions.exponent("force", REAL_GRAVITY)),
        disagrees=f"Under real gravity the weight goes as h^3 and not as the contact forces: Eq. 2 "
        f"fails for a heap, a "
        f"silo or a screw unless gravity is scaled by h^{needed}. Broken: {_broken()}.",
    )


def _broken() -> str:
    table = dimensions.group_exponents(
        dimensions.settings_of(dimensions.PAPER_RULE, ("acceleration",))
    )
    return ", ".join(table.group[~table.kept])


@claim_check("eq8.modulus")
def modulus(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        int(dimensions.exponent("modulus", RULE)), agrees="Holds where velocity is kept."
    )


@claim_check("section121.modulus")
def modulus_adapts(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        "adapts" if dimensions.exponent("modulus", RULE) else "is unchanged",
        disagrees="Contradicts Eq. 8: the modulus is kept. Under gravity-consistent scaling it "
        "would go as "
        f"h^{dimensions.exponent('modulus', REAL_GRAVITY)}.",
    )


@claim_check("section121.stiffness")
def stiffness(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        int(dimensions.exponent("stiffness", RULE)),
        agrees="Holds for a constant modulus and the same relative overlap.",
    )


def _groups(paper: Paper) -> dict[str, dict[str, float]]:
    table = paper.text("dimensionless_groups", "group", "quantity", "exponent")
    powers = paper.numbers("dimensionless_groups", "exponent").exponent
    found: dict[str, dict[str, float]] = {}
    for group, quantity, power in zip(table.group, table.quantity, powers, strict=True):
        found.setdefault(group, {})[quantity] = power
    return found


def _needed_exponent(powers: dict[str, float], quantity: str) -> float:
    """Exponent of the radius with which `quantity` must go for the group to keep its value."""
    rest = sum(power * RULE[q] for q, power in powers.items() if q != quantity)
    return -rest / powers[quantity]


@table_check
def dimensionless(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    for group, powers in _groups(paper).items():
        total = [sum(p * dimensions.DIMENSIONS[q][i] for q, p in powers.items()) for i in range(3)]
        claim = Claim(
            f"eq15.{group}", "Eq. 15", f"{group} is dimensionless (powers of M, L, T)", "0 0 0", "1"
        )
        yield (
            claim,
            Recomputed(
                " ".join(f"{t:g}" for t in total), disagrees="The group is no dimensionless number."
            ),
        )


@claim_check("section122.stiffness", "section122.damping")
def invariant_ratio(paper: Paper, claim: Claim) -> Recomputed:
    group, quantity = {
        "stiffness": ("pi2", "stiffness"),
        "damping": ("pi3", "damping_coefficient"),
    }[claim.id.split(".")[1]]
    power = _needed_exponent(_groups(paper)[group], quantity)
    return Recomputed(
        power,
        exact=True,
        disagrees=f"{group} keeps {quantity.replace('_', ' ')} over R^{power:g}, as the same "
        f"sentence then says.",
    )


@claim_check("section122.restitution")
def restitution(paper: Paper, claim: Claim) -> Recomputed:
    groups = _groups(paper)
    k, c = (
        _needed_exponent(groups["pi2"], "stiffness"),
        _needed_exponent(groups["pi3"], "damping_coefficient"),
    )
    ratio = dimensions.damping_ratio_exponent(k, c, float(dimensions.exponent("mass", RULE)))
    return Recomputed(
        float(ratio),
        exact=True,
        disagrees=f"It is the damping coefficient c_n that goes as R^{c:g}. The restitution "
        f"depends on c/(2 sqrt(k m)) "
        f"alone and goes as R^{ratio}: it is not recalibrated for the particle's size.",
    )


@claim_check("eq9.signs")
def contact_signs(paper: Paper, claim: Claim) -> Recomputed:
    """The signs with which m x'' = +-k x +-c x' oscillates and decays (m = k = 1, weak damping)."""
    names = {1: "+", -1: "-"}
    decaying = [
        f"{names[k]} {names[c]}"
        for k, c in product((1, -1), repeat=2)
        if np.linalg.eigvals(np.array([[0, 1], [k, 0.1 * c]])).real.max() < 0
    ]
    return Recomputed(
        " ".join(decaying),
        disagrees="With the printed signs the overlap grows without bound: a misprint, which Eq. "
        "13 and 14 carry on.",
    )
