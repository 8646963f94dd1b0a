"""Friction that falls with load: mu = mu0 (F / F0)^-n, n <= 1/3.

A Hertz contact whose shear strength is constant over its area gives n = 1/3 (Archard 1957, Proc. R.
Soc. A 243:190). The yield locus of the bulk is then curved and runs through the origin.
"""

from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, power


@law
def limit(p, normal):
    """Largest tangential force [N] under a repulsive normal force [N]: mu0 F0^n F^(1-n), finite at
    F = 0."""
    share = power(normal / p.friction_reference, 1.0 - p.friction_exponent)
    return p.friction * p.friction_reference * share


LAW = Law(
    slot="friction",
    name="stress_dependent",
    equation="μ0 (F_n/F_0)^(−n) F_n, n ≤ 1/3",
    source="Archard (1957)",
    kernels={"limit": limit},
    parameters=(
        Parameter("friction_exponent", "friction_exponent", "n", {"ge": 0, "le": 1 / 3 + 1e-9}),
        Parameter("friction_reference_force_N", "friction_reference", "F0", {"gt": 0}, unset=1.0),
    ),
    constants=("friction_exponent", "friction_reference"),
    left_out="NOT CONVERTED: friction stress_dependent; the coefficient is that without load "
    "dependence.",
)
