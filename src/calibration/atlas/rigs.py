"""The laboratory's tests of the atlas, told without units: lengths over the grain's diameter,
speeds as Froude numbers, cohesion as a Bond number. One grain stands for all, as its stiffness is
told alike: its shear modulus is SOFTNESS times rho g d.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from calibration.study.config.specs import with_levels
from calibration.study.new.grains import energy_of_weight, filling
from calibration.study.new.laboratory import COHESION, WALL_COHESION
from dem.constants import GRAVITY
from dem.experiments.heap import solid_rate
from dem.grains.dumbbell import sphere_radius
from dem.tables import table_of
from dem.units import unit_of


class Grain(NamedTuple):
    """Diameter [mm] of the sphere of a grain's volume, and its density [kg/m3]."""

    mm: float
    density: float


ONE = Grain(2.0, 1500.0)
"""The one grain of all runs."""
SOFTNESS = 5e4
"""Shear modulus over rho g d. A modulus of 3 MPa, which studies take, is 1e5 for grains of 2 mm and
5e4 for grains of 4 mm."""


@dataclass(frozen=True)
class Input:
    """A number without a unit over which the runs of a test are spread; inputs.csv says what its
    fields are."""

    name: str
    key: str
    of: str
    low: float
    high: float
    scale: str
    plain: float
    beyond: str
    meaning: str
    reason: str

    def value(self, share: float) -> float:
        """The value at a share in [0, 1] of the design."""
        spread = max(share - self.plain, 0.0) / (1.0 - self.plain)
        forward, back = _SCALES[self.scale]
        low, high = forward(self.low), forward(self.high)
        return float(back(low + spread * (high - low))) if spread else self.low

    def coded(self, value: Any) -> Any:
        """Where values, an array or one, stand between low (0) and high (1)."""
        forward = _SCALES[self.scale][0]
        low = forward(self.low)
        return (forward(value) - low) / (forward(self.high) - low)

    def level(self, value: float, at: Mapping[str, float], grain: Grain) -> float:
        """The level of a run spec at a value; at: {name: value} of the inputs before it."""
        return _LEVELS[self.of](value, at, grain)

    def read(self, level: float, at: Mapping[str, float], grain: Grain) -> float:
        """The way back: a level goes with the value, and a rotation's with the root of it."""
        share = level / self.level(1.0, at, grain)
        return share**2 if self.of == "froude" else share


_SCALES: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "linear": (np.asarray, np.asarray),
    "log": (np.log, np.exp),
    "inverse": (np.reciprocal, np.reciprocal),
    "root": (np.sqrt, np.square),
}
"""How an input is spread, and the way back."""


def grains_of_cone(plate: float) -> float:
    """Grains of a cone of 35° on a plate, which is in diameters."""
    return filling(math.pi / 24.0 * math.tan(math.radians(35.0)) * plate**3, 1.0)


def relative_length(elongation: float) -> float:
    """Length of a grain, in diameters of the sphere of its volume."""
    return float(elongation * sphere_radius(1.0, elongation))


def as_pair(reach: float) -> float:
    """Length over width of two bonded spheres as long as a clump of the same volume; reach: its
    length in diameters of the sphere of that volume."""
    longest = min(max(reach, 1.0), relative_length(2.0))
    return float(brentq(lambda e: relative_length(e) - longest, 1.0, 2.0))


def _wide(name, at):
    """A width, which is over the grain's length, in diameters."""
    return at[name] * relative_length(at["elongation"])


def _bed(wide, depth):
    """Grains of a round bed, which is in diameters."""
    return filling(math.pi / 4.0 * wide**2 * depth, 1.0)


def _feed(share, at, grain):
    """Grains per second of a share of what the orifice passes."""
    d = 1e-3 * grain.mm
    rate = solid_rate(_wide("orifice", at) * d, relative_length(at["elongation"]) * d)
    return share * rate / (math.pi / 6.0 * d**3)


def _rotation(froude, at, grain):
    """Degrees per second of a drum."""
    radius = 0.5e-3 * _wide("drum", at) * grain.mm
    return math.degrees(math.sqrt(froude * GRAVITY / radius))


_LEVELS: dict[str, Callable[[float, Mapping[str, float], Grain], float]] = {
    "number": lambda x, at, grain: x,
    "bond": lambda x, at, grain: x * energy_of_weight(*grain),
    "diameter": lambda x, at, grain: x * grain.mm,
    "length": lambda x, at, grain: x * relative_length(at["elongation"]) * grain.mm,
    "radius": lambda x, at, grain: x * 0.5 * at["plate"] * grain.mm,
    "orifice": lambda x, at, grain: x * _wide("orifice", at) * grain.mm,
    "cone": lambda x, at, grain: x * grains_of_cone(at["plate"]),
    "cylinder": lambda x, at, grain: x * _bed(_wide("cylinder", at), _wide("cylinder", at)),
    "vessel": lambda x, at, grain: x * _bed(_wide("vessel", at), _wide("vessel", at)),
    "drum": lambda x, at, grain: x * _bed(_wide("drum", at), _wide("width", at)),
    "feed": _feed,
    "speed": lambda x, at, grain: 1e3 * x * math.sqrt(1e-3 * GRAVITY * grain.mm),
    "froude": _rotation,
}
"""{what an input is a number of: its level in a run spec}."""


def _inputs():
    """{test: its inputs} of inputs.csv."""
    found: dict[str, list[Input]] = {}
    text = files("calibration.atlas").joinpath("inputs.csv").read_text("utf-8")
    for _, row in table_of(text).rows:
        numbers = {k: float(row[k]) for k in ("low", "high", "plain")}
        found.setdefault(row.pop("test"), []).append(Input(**row | numbers))  # type: ignore[arg-type]
    return found


_INPUTS = _inputs()
GRAIN = tuple(_INPUTS["all"])
"""Inputs of every test. No other key of a grain moves anything there: the wall's restitution is
taken to be the grains', and Poisson's ratio to be nothing."""


def size_of_unit(metric: str, grain: Grain) -> float:
    """A metric of 1 without a unit, in its own."""
    flow = 1e3 * grain.density * math.sqrt(GRAVITY) * (1e-3 * grain.mm) ** 2.5  # [g/s]
    sizes = {"mm": grain.mm, "kg/m³": grain.density, "g/s": flow}
    return sizes.get(unit_of(metric) or "", 1.0)  # an angle and a share have none


@dataclass(frozen=True, eq=False)
class Rig:
    """A test of the atlas: its name, experiment, title, the metrics that are kept of its runs, and
    what its run has beside the levels of its inputs: of {name: value} and these levels {key: level}
    and the diameter [mm]."""

    name: str
    experiment: str
    title: str
    readings: tuple[str, ...]
    beside: Callable[[Mapping[str, float], Mapping[str, float], float], dict[str, float]]

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Of the rig alone."""
        return tuple(_INPUTS[self.name])

    def input(self, name: str) -> Input:
        """The rig's input of a name."""
        return next(i for i in self.inputs if i.name == name)

    @property
    def all_inputs(self) -> tuple[Input, ...]:
        """Of the grain and of the rig."""
        return (*GRAIN, *self.inputs)

    def run(self, at: Mapping[str, float], mm: float) -> dict[str, Any]:
        """Geometry, number of grains and numerics of a run at {name: value} of all inputs, for
        grains of a diameter [mm]."""
        levels = {i.key: i.level(at[i.name], at, Grain(mm, ONE.density)) for i in self.inputs}
        levels |= self.beside(at, levels, mm)
        return with_levels({}, levels | {"particles.count": round(levels["particles.count"])})

    def spec(self, at: Mapping[str, float], seed: int) -> dict[str, Any]:
        """Run spec of the one grain at {input: value}."""
        levels: dict[str, float | str] = {i.key: i.level(at[i.name], at, ONE) for i in GRAIN}
        levels["contacts.particle_wall.restitution"] = at["restitution"]
        levels["particles.diameter_mm"] = ONE.mm
        if energy := levels.pop(COHESION):
            levels |= {"laws.cohesion": "jkr", COHESION: energy, WALL_COHESION: energy}
        softness = SOFTNESS * ONE.density * GRAVITY * (1e-3 * ONE.mm)
        grain = {"density_kg_m3": ONE.density, "shear_modulus_Pa": softness}
        about = {"experiment": self.experiment, "seed": seed, "materials": {"particle": grain}}
        return with_levels(about | self.run(at, ONE.mm), levels)


def _beside_heap(at, levels, mm):
    """A funnel, grains that fall out of it, and the time for all of them to come to rest."""
    fed = round(levels["particles.count"]) / levels["geometry.generation_rate_per_s"]
    return {
        "geometry.funnel_top_diameter_mm": levels["geometry.orifice_diameter_mm"] + 20.0 * mm,
        "geometry.injection_speed_m_s": 2.0 * math.sqrt(GRAVITY * (1e-3 * mm)),
        "numerics.max_time_s": fed + 6.0 * math.sqrt(mm / ONE.mm),
    }


_HEAP = "angle_of_repose_deg", "radial_angle_deg", "height_mm"
RIGS = {
    rig.name: rig
    for rig in (
        Rig("heap", "heap", "heap of a funnel", _HEAP, _beside_heap),
        Rig("cylinder", "lifted_cylinder", "heap of a lifted cylinder", (*_HEAP, "base_radius_mm"),
            lambda _, levels, mm:
                {"geometry.plate_diameter_mm": 6.0 * levels["geometry.cylinder_diameter_mm"]}),
        Rig("density", "bulk_density", "poured density",
            ("poured_density_kg_m3", "poured_solid_fraction"), lambda *_: {"geometry.taps": 0}),
        Rig("silo", "discharge", "discharge of a silo", ("mass_flow_g_s", "bulk_density_kg_m3"),
            lambda at, *_: {"particles.count":
                _bed(at["silo"] * _wide("orifice", at), 1.9 * _wide("orifice", at))}),
        Rig("drum", "drum", "turning drum", ("dynamic_angle_deg",),
            lambda *_: {"geometry.start_turns": 0.3, "geometry.turns": 0.25}),
    )
}  # fmt: skip
BY_EXPERIMENT = {rig.experiment: rig for rig in RIGS.values()}
