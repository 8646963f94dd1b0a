"""Viscoelastic spheres: 1 - e grows as v^(1/5).

F = k (overlap^(3/2) + (3/2) A sqrt(overlap) d(overlap)/dt),   k = (4/3) E* sqrt(R*), not attractive.

Brilliantov, Spahn, Hertzsch, Poeschel (1996), Physical Review E 53:5382. A is the dissipation time. (3/2) k
sqrt(overlap) is the contact stiffness S_n, so the dissipative part is -A S_n v_n.
"""

from dem.lanes import law, maximum


@law
def normal_force(p, elastic, stiffness, v_n):
    """Elastic force less the viscous part, never attractive [N]."""
    return maximum(elastic - p.viscous_time * stiffness * v_n, 0.0)
