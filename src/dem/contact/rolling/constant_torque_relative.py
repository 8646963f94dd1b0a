"""Constant directional torque on the relative spin, equal and opposite on the two spheres.

T = -mu_r F_n R* omega_r / |omega_r|, omega_r the tangential part of omega_i - omega_j. It conserves
angular momentum. The torque is limited to what stops the relative spin within the step. LIGGGHTS'
manual describes this law as `cdt`. Its code divides by the whole relative spin, twist included, and
does not stop at reversal.
"""

from dem.contact.export import Export
from dem.contact.law import Law
from dem.kernel.arithmetic import TINY, dot, law, minimum, reject, scale, sqrt


@law
def torque(p, n, spin, normal, stiffness, unloading, r_eff, inertia, spring, dt):
    """Torque on the first sphere (3,) [N m]; the spring moment is not its business.

    spin: omega_i - omega_j (3,) [rad/s]; inertia: I_i I_j / (I_i + I_j) [kg m2].
    """
    rolling = reject(spin, n)
    speed = sqrt(dot(rolling, rolling)) + TINY
    size = minimum(p.rolling * normal * r_eff, inertia * speed / dt)
    return scale(-size / speed, rolling), spring


LAW = Law(
    slot="rolling",
    name="constant_torque_relative",
    equation="μ_r F_n R* on the relative spin (LIGGGHTS `cdt` as its manual has it)",
    source="Ai et al. (2011), type A",
    kernels={"rolling": torque},
    creeps=True,
    exports={"edem": Export("Hertz-Mindlin with RVD rolling friction")},
)
