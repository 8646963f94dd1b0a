"""Elastic-plastic spring-dashpot rolling resistance (EPSD, type C).

The spring moment grows by -k_r omega_r dt, k_r = factor S_n (mu_r R*)^2 (factor 2.25: Iwashita and Oda 1998), up to
mu_r F_n R*; below that limit a dashpot 2 eta_r sqrt(I k_r) acts beside it.
Ai, Chen, Rotter, Ooi (2011), Powder Technology 206:269, model C.
"""

from dem.lanes import law, minimum, sqrt, where
from dem.vectors import dot, reject, scale, subtract

TINY = 1e-30


@law
def torque(p, n, spin, normal, stiffness, r_eff, inertia, spring, dt):
    """Torque on the first sphere and the new spring moment, both (3,) [N m]."""
    arm = p.rolling * r_eff
    k_r = p.rolling_stiffness * stiffness * arm * arm
    rolling = reject(spin, n)
    spring = subtract(reject(spring, n), scale(k_r * dt, rolling))
    size = sqrt(dot(spring, spring)) + TINY
    full = arm * normal
    spring = scale(minimum(full / size, 1.0), spring)
    dashpot = where(size < full, p.rolling_damping * 2.0 * sqrt(inertia * k_r), 0.0 * full)
    return subtract(spring, scale(dashpot, rolling)), spring
