"""A sphere's impact on a plate: Hertz contact with constant-restitution damping, integrated with
few steps."""

import numpy as np

# Hertz: duration = 2.9432 x peak overlap / speed (Johnson, Contact Mechanics, 1985, 11.4).
DURATION_OVER_OVERLAP_TIME = 2.9432


def effective_modulus(shear_a: float, poisson_a: float, shear_b: float, poisson_b: float) -> float:
    """Hertz's E* [Pa] from shear moduli [Pa] and Poisson ratios."""
    return 1 / ((1 - poisson_a) / (2 * shear_a) + (1 - poisson_b) / (2 * shear_b))


def contact_time(radius: float, density: float, modulus: float, speed: float) -> float:
    """Duration [s] of a sphere's elastic impact on a plate: `radius` [m], `density` [kg/m3], E*
    [Pa], `speed` [m/s]."""
    mass = 4 / 3 * np.pi * radius**3 * density
    stiffness = 4 / 3 * modulus * np.sqrt(radius)
    overlap = (5 * mass * speed**2 / (4 * stiffness)) ** 0.4
    return float(DURATION_OVER_OVERLAP_TIME * overlap / speed)


def rayleigh_time(
    radius: float, density: float, shear_modulus: float, poisson_ratio: float
) -> float:
    """Rayleigh time [s] of a sphere, pi R sqrt(rho/G) / (0.1631 nu + 0.8766), as EDEM defines
    it."""
    return float(
        np.pi * radius * np.sqrt(density / shear_modulus) / (0.1631 * poisson_ratio + 0.8766)
    )


def stepped_restitution(restitution: np.ndarray, steps: float, phases: int = 200) -> np.ndarray:
    """Rebound over impact speed when a contact is integrated with few steps.

    In units of the speed, m* and the Hertz stiffness: x'' = -x^(3/2) - 2 sqrt(5/6) beta sqrt(S) x',
    S = (3/2) sqrt(x), attractive end kept; semi-implicit Euler, `steps` time steps in the elastic
    contact's duration. The first step ends anywhere in the contact: `phases` evenly spaced starts.

    Parameters
    ----------
    restitution : (k,) nominal values in (0, 1)

    Returns
    -------
    (k, phases)
    """
    log_e = np.log(np.asarray(restitution, float))[:, None]
    damping = 2 * np.sqrt(5 / 6) * (-log_e / np.sqrt(log_e**2 + np.pi**2))
    dt = DURATION_OVER_OVERLAP_TIME * 1.25**0.4 / steps
    x = np.broadcast_to(-dt * (np.arange(phases) + 0.5) / phases, (len(log_e), phases)).copy()
    v = np.ones_like(x)
    for _ in range(int(20 * steps) + 20):
        overlap = np.maximum(x, 0)
        v -= dt * (overlap**1.5 + damping * np.sqrt(1.5 * np.sqrt(overlap)) * v)
        x += dt * v
        if np.all((x < 0) & (v < 0)):
            break
    return -v
