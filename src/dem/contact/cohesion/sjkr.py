"""Simplified JKR: an attraction in proportion to the contact area, F = k A, A = pi R* overlap.

k is the cohesion energy density [J/m3]. The attraction ends where the spheres part.
"""

from dem.lanes import law


@law
def attraction(p, overlap, r_eff):
    """Attractive force [N]."""
    return p.cohesion * 3.141592653589793 * r_eff * overlap
