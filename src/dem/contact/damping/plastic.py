"""Elastic, perfectly plastic spheres: restitution falls as v^(-1/4) above the yield speed.

Loading is Hertzian to the overlap at which the pressure in the middle of the contact reaches p_y,
then linear, F = F_y + pi R* p_y (overlap - overlap_y). Unloading and reloading follow a Hertz law
of a flattened radius R_p = (4 E* / 3 F_m) ((2 F_m + F_y) / (2 pi p_y))^(3/2), with F_m the largest
force so far.
Thornton (1997), Journal of Applied Mechanics 64:383. Below yield the dashpot of `tsuji` gives the
base restitution."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dem.contact.damping.tsuji import factor
from dem.contact.law import Law, Parameter
from dem.grains import sphere
from dem.kernel.arithmetic import law, maximum, sqrt, where

if TYPE_CHECKING:
    from dem.contact.registry import Material


def yield_pressure(yield_speed: float, material: Material, radius: float) -> float:
    """p_y [Pa] of a material of which a sphere of radius [m] yields on a rigid flat from
    yield_speed [m/s] up.

    Rigid, so that p_y is of the material alone and the same in all its contacts: E* = E/(1 - nu^2),
    R* = R, m* = m. At yield the overlap is (pi p_y / 2 E*)^2 R* and the elastic energy (2/5) k
    overlap^(5/2) equals m* v^2 / 2.
    """
    young, density = material.young_modulus / (1.0 - material.poisson_ratio**2), material.density
    mass = sphere.mass(radius, density)
    k = 4.0 / 3.0 * young * math.sqrt(radius)
    overlap = (1.25 * mass * yield_speed**2 / k) ** 0.4
    return 2.0 * young / math.pi * math.sqrt(overlap / radius)


@law
def damped(p, elastic, stiffness, overlap, r_eff, m_eff, v_n, deepest):
    """Hysteretic force less the dashpot [N] and the new deepest overlap [m]."""
    p_y = p.yield_pressure
    k = (4.0 / 3.0) * p.young * sqrt(r_eff)
    ratio = 0.5 * math.pi * p_y / p.young
    yield_overlap = ratio * ratio * r_eff
    yield_force = k * yield_overlap * sqrt(yield_overlap)
    deepest = maximum(deepest, overlap)
    flow = maximum(deepest - yield_overlap, 0.0)
    largest = yield_force + math.pi * r_eff * p_y * flow
    # squared contact radius at unloading
    contact_area = (2.0 * largest + yield_force) / (2.0 * math.pi * p_y)
    flattened = (4.0 / 3.0) * p.young / largest * contact_area * sqrt(contact_area)
    recovered = contact_area / flattened  # elastic part of the deepest overlap
    left = maximum(overlap - (deepest - recovered), 0.0)
    unloading = (4.0 / 3.0) * p.young * sqrt(flattened * left) * left
    force = where(deepest > yield_overlap, unloading, elastic)
    dashpot = p.damping * sqrt(stiffness * m_eff) * v_n
    return where(force > 0.0, force - dashpot, 0.0 * force), deepest


LAW = Law(
    slot="damping",
    name="plastic",
    equation="Hertz to yield, linear beyond, flattened Hertz unloading: e falls as v^(−1/4)",
    source="Thornton (1997)",
    kernels={"damped": damped},
    parameters=(
        Parameter(
            key="yield_velocity_m_s",
            name="yield_pressure",
            meaning="speed at which the mean grain begins to yield on a rigid flat",
            limits={"gt": 0},
            unset=math.inf,
            to_si=lambda speed, grain: yield_pressure(speed, grain.material, grain.radius),
        ),
    ),
    constants=("damping", "yield_pressure"),
    values=lambda contact: {"damping": factor(contact.restitution)},
    only_with={"normal": ("hertz",)},
    left_out="NOT CONVERTED: damping plastic, whose restitution depends on the impact speed; the "
    "constant coefficient of restitution stands in its place.",
)
