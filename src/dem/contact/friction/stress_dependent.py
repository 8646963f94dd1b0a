"""Friction that falls with load: mu = mu0 (F / F0)^-n, n <= 1/3.

A Hertz contact whose shear strength is constant over its area gives n = 1/3 (Archard 1957, Proc. R. Soc. A 243:190).
The yield locus of the bulk is then curved and runs through the origin.
"""

from dem.lanes import law, power


@law
def limit(p, normal):
    """Largest tangential force [N] under a repulsive normal force [N]: mu0 F0^n F^(1-n), finite at F = 0."""
    share = power(normal / p.friction_reference, 1.0 - p.friction_exponent)
    return p.friction * p.friction_reference * share
