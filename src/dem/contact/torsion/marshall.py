"""Torsion: resistance to relative spin about the normal of the contact, handed over by sliding
friction.

Spring k_t a^2/2, dashpot eta_t a^2/2, limit (2/3) a mu F_n: k_t and eta_t are stiffness and dashpot
of the tangential law, a the contact radius, mu F_n the limit of sliding friction. Marshall (2009),
Journal of Computational Physics 228:1541, Eqs. 30, 32 and 44; LAMMPS has the law as `twisting
marshall`. Like the tangential spring the moment is kept and scaled while the contact unloads, here
by (a/a_before)^3 as the stiffness 4 G* a^3: a varying stiffness then creates no energy.
"""

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import law, maximum, minimum, sqrt


@law
def torque(p, rate, contact_radius, unloading, m_eff, spring, limit, dt):
    """Torque about the normal on the first sphere and the new spring moment, both [N m].

    rate: relative spin about the normal [rad/s]; contact_radius a [m]; unloading: a/a_before, at
    most 1 [-]; spring [N m]; limit: of sliding friction [N].
    """
    tangential = 8.0 * p.shear * contact_radius
    square = 0.5 * contact_radius * contact_radius
    spring = unloading * unloading * unloading * spring - square * tangential * dt * rate
    most = (2.0 / 3.0) * contact_radius * limit
    spring = maximum(minimum(spring, most), -most)
    whole = spring - square * p.damping * sqrt(tangential * m_eff) * rate
    return maximum(minimum(whole, most), -most), spring


LAW = Law(
    slot="torsion",
    name="marshall",
    equation="spring 4 G* a³ and dashpot about the normal, limit (2/3) a μ F_n",
    source="Marshall (2009)",
    kernels={"torsion": torque},
    default=True,
    constants=("damping",),
    only_with={"tangential": ("mindlin",)},
    exports={"lammps": Export(words="twisting marshall")},
    left_out="NOT CONVERTED: torsion marshall; a grain that spins about the normal of its contact "
    "spins on.",
    dispensable=True,
)
