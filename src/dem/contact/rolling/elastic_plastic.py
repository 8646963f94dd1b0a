"""Elastic-plastic spring-dashpot rolling resistance (EPSD, type C).

The spring moment grows by -k_r omega_r dt up to mu_r F_n R*, with k_r = factor S_n (mu_r R*)^2
(factor 2.25: Iwashita and Oda 1998). Below that limit a dashpot 2 eta_r sqrt(I_c k_r) acts too.
I_c is the moment of inertia about the contact point, (7/5) m R^2, reduced for two spheres. eta_r is
then the damping ratio of a sphere that rocks without slip, as in EDEM's type C and LIGGGHTS' epsd.
Ai, Chen, Rotter, Ooi (2011), Powder Technology 206:269, model C.

The moment is kept while the contact loads. While it unloads the moment is scaled by a/a_before, a
the contact radius, like the tangential spring: k_r depends on a, and a varying stiffness must not
create energy.

k_r grows with mu_r^2, and the time step does not depend on it. Beyond a certain mu_r the spring of
a grain among its neighbours would be stiffer than leapfrog bears, and the grain would tremble.
There k_r is held at `limit` I/dt^2. The largest torque stays as it is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dem.contact.export import Export
from dem.contact.law import Law, Parameter
from dem.contact.tangential.mindlin import MERCURY
from dem.kernel.arithmetic import dot, law, maximum, minimum, reject, scale, sqrt, subtract, where

if TYPE_CHECKING:
    from dem.contact.export import Pair


LEAST = 1e-35  # N m: keeps a contact without load from dividing by zero
CONTACT_POINT = 1.4 / 0.4
"""Moment of inertia of a solid sphere about a point of its surface over that about its centre."""
NEIGHBOURS = 8
"""Contacts of a grain whose rolling springs are at the limit at once; the mean in a packing is 4 to
6."""


def limit(damping_ratio: float) -> float:
    """Largest k_r dt^2/I of one contact, I reduced about the centres [-].

    A spin against those of Z equal neighbours has the frequency w^2 = Z k_r/I and the damping ratio
    z = sqrt(Z I_c/I) eta_r. Leapfrog with a dashpot that sees the spin of half a step before is
    stable up to w dt = 2 (sqrt(1 + z^2) - z).
    """
    z = math.sqrt(NEIGHBOURS * CONTACT_POINT) * damping_ratio
    return 4.0 * (math.sqrt(1.0 + z * z) - z) ** 2 / NEIGHBOURS


@law
def torque(p, n, spin, normal, stiffness, unloading, r_eff, inertia, spring, dt):
    """Torque on the first sphere and the new spring moment, both (3,) [N m].

    spin: omega_i - omega_j (3,) [rad/s]; normal: repulsive force [N]; stiffness S_n [N/m];
    unloading: a/a_before, at most 1 [-]; inertia: I_i I_j / (I_i + I_j) about the centres [kg m2].
    """
    arm = p.rolling * r_eff
    k_r = p.rolling_stiffness * stiffness * arm * arm
    k_r = minimum(k_r, p.rolling_limit * inertia / (dt * dt))
    rolling = reject(spin, n)
    spring = subtract(scale(unloading, reject(spring, n)), scale(k_r * dt, rolling))
    full = arm * normal
    # float32 holds neither the square of a fine grain's moment nor I k_r
    share = scale(1.0 / maximum(full, LEAST), spring)
    size = sqrt(dot(share, share))
    spring = scale(where(full > 0.0, minimum(1.0 / size, 1.0), 0.0 * full), spring)
    critical = 2.0 * inertia * sqrt(CONTACT_POINT * (k_r / inertia))
    dashpot = where(size < 1.0, p.rolling_damping * critical, 0.0 * full)
    return subtract(spring, scale(dashpot, rolling)), spring


SECANT = 1.5
"""Tangent over secant of the Hertz force: LIGGGHTS' spring is a factor of the secant."""
EDEM_FACTOR = 2.25
CONSTANT = (
    "The rolling spring is a constant in {} that of a contact under {:.3g} N, ten grain weights"
)


def spring_of(pair: Pair) -> float:
    """Rotational stiffness k_r [N m] of a `Pair` under its load: factor S_n (mu_r R*)^2, S_n = 2 E*
    a."""
    normal, arm = (
        2.0 * pair.young * pair.contact_radius,
        pair.contact.rolling_friction * pair.radius,
    )
    return pair.contact.rolling_stiffness * normal * arm**2


def mercury_spring(pair: Pair) -> float:
    """Rotational stiffness [N m] in MercuryDPM under the load of a `Pair`: 8 G a (2 R*)^2, G its
    own shear modulus."""
    return 8.0 * pair.shear / MERCURY * pair.contact_radius * (2.0 * pair.radius) ** 2


def dashpot_of(pair: Pair, spring: float) -> float:
    """Coefficient of the rolling dashpot [N m s] of a `Pair` beside a spring [N m]: 2 ratio sqrt(I
    k_r)."""
    return 2.0 * pair.contact.rolling_damping * math.sqrt(pair.inertia * spring)


def _in_edem(factor):
    notes = [
        "The numbers of type C are used as they are; here alone the rolling spring's moment falls "
        "with the stiffness while a contact unloads (docs/howto-export.md)."
    ]
    if factor != EDEM_FACTOR:
        notes.append(
            f"NOT CONVERTED: the factor of the rolling stiffness, {factor:g}; EDEM has "
            f"{EDEM_FACTOR}."
        )
    return notes


LAW = Law(
    slot="rolling",
    name="elastic_plastic",
    equation="spring k_r = 2.25 S_n (μ_r R*)², dashpot 2η√(I_c k_r), limit μ_r F_n R*",
    source="Ai et al. (2011), type C; Iwashita, Oda (1998)",
    kernels={"rolling": torque},
    default=True,
    parameters=(
        Parameter(
            key="rolling_stiffness_factor",
            name="rolling_stiffness",
            meaning="of the spring, over S_n (mu_r R*)^2",
            limits={"gt": 0},
            default=2.25,
        ),
        Parameter(
            key="rolling_damping_ratio",
            name="rolling_damping",
            meaning="of a grain that rocks without slip",
            limits={"ge": 0},
            default=0.3,
        ),
    ),
    constants=("rolling_stiffness", "rolling_damping", "rolling_limit"),
    values=lambda contact: {"rolling_limit": limit(contact.rolling_damping)},
    exports={
        "liggghts": Export(
            "epsd3",
            "rolling_friction epsd3",
            lambda pair: {
                "coefficientRollingFriction": pair.contact.rolling_friction,
                "coefficientRollingViscousDamping": pair.contact.rolling_damping,
                "rollingStiffness": SECANT * pair.contact.rolling_stiffness,
            },
            alone=("rollingStiffness",),
        ),
        "lammps": Export(
            "rolling sds",
            "rolling sds",
            lambda pair: {
                "k": spring_of(pair) / pair.radius**2,
                "gamma": dashpot_of(pair, spring_of(pair)) / pair.radius**2,
                "mu": pair.contact.rolling_friction,
            },
            notes=lambda pair: [CONSTANT.format("LAMMPS:", pair.load) + "."],
        ),
        "yade": Export(
            "the rolling moment of Law2_ScGeom_MindlinPhys_Mindlin",
            "includeMoment=True",
            lambda pair: {
                "krot": spring_of(pair),
                "eta": 0.5 * pair.contact.rolling_friction,
                "maxBendPl": pair.contact.rolling_friction,  # times the grain's radius
            },
            notes=lambda pair: [
                CONSTANT.format("YADE,", pair.load) + ", and has no dashpot. eta is one number for "
                "all pairs, so wallRolling() sets the moment of grains on walls."
            ],
        ),
        "mercurydpm": Export(
            "rolling of HertzianViscoelasticMindlinRollingTorsionSpecies",
            "",
            lambda pair: {
                "RollingFrictionCoefficient": 0.5 * pair.contact.rolling_friction,
                "RollingDissipation": dashpot_of(pair, mercury_spring(pair))
                / (2.0 * pair.radius) ** 2,
            },
            notes=lambda pair: [
                "MercuryDPM takes the stiffness of the rolling spring from the shear modulus; it "
                "is stiffer than in the runs behind this number."
            ],
        ),
        "edem": Export(
            "Hertz-Mindlin with type C rolling friction",
            "Rolling friction, type C",
            lambda pair: {
                "Rolling viscous damping ratio": pair.contact.rolling_damping,
                "Factor of the rolling stiffness": pair.contact.rolling_stiffness,
            },
            alone=("Rolling viscous damping ratio", "Factor of the rolling stiffness"),
            notes=lambda pair: _in_edem(pair.contact.rolling_stiffness),
        ),
    },
)
