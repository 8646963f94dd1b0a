"""How a law declares itself: one file under `dem.contact.<slot>`, with its kernels and a `LAW`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

ROLES = {
    "normal": "p, overlap, r_eff, deepest",
    "damped": "p, elastic, stiffness, overlap, r_eff, grain, m_eff, v_n, deepest",
    "attraction": "p, overlap, r_eff, grain",
    "reach": "p, r_eff, grain",
    "limit": "p, normal, v_t, grain",
    "tangential": "p, n, v_t, stiffness, contact_radius, radius_before, m_eff, spring, limit, dt",
    "rolling": "p, n, spin, normal, stiffness, unloading, r_eff, inertia, spring, dt",
    "resistance": "p, normal, radius",
    "torsion": "p, rate, contact_radius, unloading, m_eff, spring, limit, dt",
}
"""What a law can do in a contact -> the arguments that its kernel may name, in SI units.

normal      elastic force [N], stiffness S_n [N/m], contact radius [m], deepest overlap so far [m],
            adhesion that loads friction beside the force [N]
damped      normal force with its dashpot [N], deepest overlap so far [m] or what else it keeps
attraction  attractive force [N]             reach       largest gap [m] that a neck or bridge spans
limit       largest tangential force [N]     tangential  force and new spring force, each (3,) [N]
rolling     torque and new spring moment on the relative spin, each (3,) [N m]
resistance  size of a torque against each own spin [N m]
torsion     torque about the normal and new spring moment [N m]

overlap [m], negative across a gap; r_eff, m_eff: effective radius [m] and mass [kg]; grain: radius
[m] of the sphere on a wall, harmonic mean radius of two; v_n [m/s], positive where the spheres
part; v_t (3,) sliding velocity [m/s]; normal: repulsive force [N]; unloading: contact radius over
that of the last step, at most 1; inertia: reduced, about the centres [kg m2]; p: the constants of
the pair of materials (`dem.contact.registry`).
"""


class Grain(NamedTuple):
    """The mean grain of a run: its `Material` and its radius [m]."""

    material: object
    radius: float


@dataclass(frozen=True)
class Parameter:
    """A constant of a law in a run spec's `law_parameters`.

    key: its name with the unit; name: that in `ContactParameters`, in SI units; limits: pydantic's
    gt, ge, lt, le; default: what it is unless given, None where it must be given; wall: whether
    grains on walls have their own, as wall_<key>, one of the two being enough; unset: value where a
    pair of materials has none; to_si: (value, `Grain`) -> SI value.
    """

    key: str
    name: str
    meaning: str
    limits: dict
    default: float | None = None
    wall: bool = False
    unset: float = 0.0
    to_si: Callable = lambda value, grain: value

    @property
    def keys(self) -> tuple[str, ...]:
        """Its key, and that of walls where they have their own."""
        return (self.key, f"wall_{self.key}") if self.wall else (self.key,)


@dataclass(frozen=True)
class Law:
    """A law as its file declares it.

    slot, name : as in a run spec's `laws`
    equation, source : a line each, for the documentation
    kernels : role -> kernel (ROLES)
    parameters : what it needs in `law_parameters`
    constants : names of what its kernels read of `p` beyond young, shear, friction and rolling
    values : `ContactParameters` -> {constant: value}, of those that are no parameter's value
    only_with : slot -> names of the laws that it can be combined with; any where a slot is missing
    not_with : slot -> names of the laws that it cannot be combined with
    default : whether a spec has it unless another is named, see `catalogue.completed`
    creeps : whether a grain that should rest under it creeps, as it has no spring
    longest_step : (`ContactParameters`, mass of the smallest grain [kg], its longest step by the
        Rayleigh time [s]) -> longest step [s]; None where the Rayleigh time's is short enough
    exports : code -> `dem.contact.export.Export`, for each code that has the law too
    holds_at_rest : why a result holds for heaps at rest alone; empty where it holds in motion
    left_out : what to say in the export to a code that does not have it; empty where it is the
        absence of a law, or where another law of its slot stands in
    dispensable : whether a heap comes out alike without it, so that no code is refused for it
    """

    slot: str
    name: str
    equation: str
    source: str = ""
    kernels: dict = field(default_factory=dict)
    parameters: tuple = ()
    constants: tuple = ()
    values: Callable = lambda contact: {}
    only_with: dict = field(default_factory=dict)
    not_with: dict = field(default_factory=dict)
    default: bool = False
    creeps: bool = False
    longest_step: Callable | None = None
    exports: dict = field(default_factory=dict)
    holds_at_rest: str = ""
    left_out: str = ""
    dispensable: bool = False
