"""Coulomb friction: the limit is mu times the normal force."""

from dem.lanes import law


@law
def limit(p, normal):
    """Largest tangential force [N] under a repulsive normal force [N]."""
    return p.friction * normal
