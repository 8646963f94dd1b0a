"""JKR adhesion with its neck: contact persists to a gap after the spheres have touched.

overlap = a^2/R* - sqrt(4 pi g a / E*),   F = 4 E* a^3 / (3 R*) - 4 sqrt(pi g E*) a^(3/2),
g surface energy per surface, so that the pull-off force is 3 pi g R*.
Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301. With s = sqrt(a) the first equation is a
quartic in s."""

from math import pi

from dem.contact.law import Law, Parameter
from dem.kernel.arithmetic import law, maximum, sqrt

ROOT_ITERATIONS, ITERATIONS = 5, 8
# keeps a surface without energy from dividing by zero; far below any length or its root here
TINY = 1e-12
# of the quartic, over c: at the reach it is 0, and a step would divide what was rounded off by it
LEAST_SLOPE = 1e-3


@law
def _cube_root(x):
    """Newton's method from x^(1/4 + 1/16 + 1/64), the root within a half for any x from 1e-30 to
    1e30."""
    fourth = sqrt(sqrt(x))
    sixteenth = sqrt(sqrt(fourth))
    root = maximum(fourth * sixteenth * sqrt(sqrt(sixteenth)), TINY)
    for _ in range(ROOT_ITERATIONS):
        root = root - (root - x / (root * root)) * (1.0 / 3.0)
    return root


@law
def _slope(p):
    """sqrt(4 pi g / E*), the factor of s in the quartic."""
    return sqrt(4.0 * pi * p.cohesion / p.young)


@law
def reach(p, r_eff):
    """Largest gap [m] that a neck spans: minus the least overlap of the quartic, at s^3 = c
    R*/4."""
    c = _slope(p)
    return 0.75 * c * _cube_root(0.25 * c * r_eff)


@law
def contact_radius(p, overlap, r_eff):
    """Contact radius a [m] on the stable branch, by Newton's method from above (the quartic is
    convex there).

    Beyond the reach, where the quartic has no root, it is that at the reach: lanes without contact
    pass through here."""
    c = _slope(p)
    overlap = maximum(overlap, -reach(p, r_eff))
    s = sqrt(sqrt(r_eff * maximum(overlap, 0.0))) + _cube_root(c * r_eff)
    for _ in range(ITERATIONS):
        cube = s * s * s / r_eff
        slope = maximum(4.0 * cube - c, LEAST_SLOPE * c + TINY * TINY)
        s = s - (cube * s - c * s - overlap) / slope
    return s * s


@law
def normal_force(p, radius, r_eff):
    """Elastic and adhesive force together [N], positive where repulsive."""
    adhesive = 4.0 * sqrt(pi * p.cohesion * p.young) * radius * sqrt(radius)
    return (4.0 / 3.0) * p.young * radius * radius * radius / r_eff - adhesive


@law
def normal(p, overlap, r_eff, deepest):
    """In place of the normal law: force, stiffness, contact radius, deepest overlap and what loads
    friction beside."""
    radius = contact_radius(p, overlap, r_eff)
    elastic = normal_force(p, radius, r_eff)
    pull_off = 3.0 * pi * p.cohesion * r_eff
    return elastic, 2.0 * p.young * radius, radius, deepest, 2.0 * pull_off


LAW = Law(
    slot="cohesion",
    name="jkr",
    equation="δ = a²/R* − √(4πγa/E*), F = 4E*a³/(3R*) − 4√(πγE*) a^1.5",
    source="Johnson et al. (1971)",
    kernels={"normal": normal, "reach": reach},
    parameters=(
        Parameter(
            key="surface_energy_J_m2",
            name="surface_energy",
            meaning="surface energy, per surface",
            limits={"ge": 0},
            wall=True,
        ),
    ),
    constants=("cohesion",),
    values=lambda contact: {"cohesion": contact.surface_energy},
    only_with={"normal": ("hertz",), "damping": ("tsuji",)},
    left_out="NOT CONVERTED: cohesion jkr; these grains do not stick.",
)
