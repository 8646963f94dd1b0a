"""Viscous damping without a pull: the force is cut to zero where the dashpot would attract.

The dashpot has the form of `tsuji`. Its factor gives the restitution that is asked for in spite of
the cut. Thornton, Cummins, Cleary (2013), Powder Technology 233:30, fit that factor by a
polynomial. Here it is solved from the equation of motion. In units of the impact this equation has
the restitution as its only parameter.
"""

from functools import lru_cache

from dem.contact.law import Law
from dem.kernel.arithmetic import law, maximum, sqrt


def restitution_of(dashpot: float) -> float:
    """Restitution of x'' = -max(0, x^(3/2) + dashpot sqrt(3/2) x^(1/4) x'), x(0) = 0, x'(0) = 1.

    With force k x^(3/2), S_n = (3/2) k sqrt(x), so the dashpot of the module's equation has this
    form at m* = k = 1."""
    # here, as reading what a law declares must not load scipy
    from scipy.integrate import solve_ivp

    def motion(_, y):
        x = max(y[0], 0.0)
        return y[1], -max(0.0, x**1.5 + dashpot * (1.5**0.5) * x**0.25 * y[1])

    def parted(_, y):
        return y[0]

    parted.terminal, parted.direction = True, -1  # type: ignore[attr-defined]
    # start a hair inside the contact so that the event does not fire at once
    end = solve_ivp(motion, (0, 1e3), (1e-9, 1.0), events=parted, rtol=1e-9, atol=1e-12)
    return -end.y[1, -1]


@lru_cache(maxsize=64)
def factor(restitution: float) -> float:
    """Dashpot factor for a coefficient of restitution in (0.02, 1]."""
    from scipy.optimize import brentq

    if restitution >= 1.0:
        return 0.0
    found = brentq(lambda c: restitution_of(c) - restitution, 0.0, 40.0, xtol=1e-8)
    # the solver's sums are those of BLAS, whose last bits depend on the processor: they end here
    return round(found, 7)


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """Elastic force less the dashpot, never attractive [N], and the deepest overlap."""
    return maximum(elastic - p.damping * sqrt(stiffness * m_eff) * v_n, 0.0), deepest


LAW = Law(
    slot="damping",
    name="thornton",
    equation="the same dashpot, never attractive; its factor is solved for so that e is met",
    source="after Thornton et al. (2013)",
    kernels={"damped": damped},
    constants=("damping",),
    values=lambda contact: {"damping": factor(contact.restitution)},
    only_with={"normal": ("hertz",)},
)
