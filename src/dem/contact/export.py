"""What another code makes of a law: each law's file says it in `exports`.

`calibration.engines` puts these words and numbers together as the files that another code reads.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Pair:
    """Constants of one kind of contact, which the numbers of an export are made of.

    young, shear: effective moduli E*, G* [Pa]; dashpot: factor of sqrt(stiffness m*) in the damping
    force [-]; radius: effective radius R* [m]; inertia: I1 I2/(I1 + I2) about the contact point
    [kg m2]; load: normal force [N] at which a constant there equals what grows with the load here;
    wall: whether a grain meets a wall; contact: `ContactParameters` of the laws.
    """

    young: float
    shear: float
    dashpot: float
    radius: float
    inertia: float
    load: float
    wall: bool
    contact: Any

    @property
    def contact_radius(self) -> float:
        """Radius a [m] of a Hertz contact under `load`: a^3 = 3 F R*/(4 E*) (Johnson 1985,
        4.22)."""
        return (0.75 * self.load * self.radius / self.young) ** (1 / 3)


@dataclass(frozen=True)
class Export:
    """What an export writes for a law that the other code has too.

    called : the law's name there, for a sentence
    words : what chooses it there
    numbers : `Pair` -> {name there: value, or values in a row}
    alone : names of the numbers that are given once, not for each pair of materials
    notes : `Pair` of two grains -> sentences on what differs there
    """

    called: str = ""
    words: str = ""
    numbers: Callable = lambda pair: {}
    alone: tuple = ()
    notes: Callable = lambda pair: ()
