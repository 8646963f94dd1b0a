"""The laboratory's tests of the atlas, told without units: lengths over the grain's diameter,
speeds as Froude numbers, cohesion as a Bond number. One grain stands for all, as its stiffness is
told alike: its shear modulus is SOFTNESS times rho g d.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from calibration.study.new.grains import filling
from dem.constants import GRAVITY
from dem.experiments.heap import solid_rate
from dem.grains.dumbbell import sphere_radius
from dem.spec import RunSpec
from dem.tables import table_of

DIAMETER, DENSITY = 2e-3, 1500.0  # of the one grain [m], [kg/m3]
SOFTNESS = 5e4
"""Shear modulus over rho g d. A modulus of 3 MPa, which studies take, is 1e5 for grains of 2 mm and
5e4 for grains of 4 mm."""
CONE_SLOPE = math.tan(math.radians(35.0))


@dataclass(frozen=True)
class Input:
    """A number without a unit over which the runs of a test are spread; inputs.csv says what its
    fields are."""

    name: str
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


_SCALES: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "linear": (np.asarray, np.asarray),
    "log": (np.log, np.exp),
    "inverse": (np.reciprocal, np.reciprocal),
    "root": (np.sqrt, np.square),
}
"""How an input is spread, and the way back."""


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


UNITS: dict[str, Callable[[float, float], float]] = {
    "angle or share": lambda diameter, density: 1.0,
    "length": lambda diameter, density: 1e3 * diameter,  # [mm]
    "density": lambda diameter, density: density,
    "mass flow": lambda diameter, density: (
        1e3 * density * math.sqrt(GRAVITY) * diameter**2.5
    ),  # [g]
}
"""Size of a unit of the atlas in that of the metric, for grains of a diameter [m] and a density
[kg/m3]."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A test of the atlas.

    run: ({name: value} of all inputs, diameter of the grain [mm]) -> the geometry, the number of
    grains, and numerics of its run. read: the way back, (run spec, diameter [mm], length over
    diameter) -> {name: value} of the rig's inputs. readings: {metric: its unit, a key of UNITS}.
    """

    name: str
    experiment: str
    title: str
    run: Callable[[Mapping[str, float], float], dict[str, Any]]
    read: Callable[[RunSpec, float, float], dict[str, float]]
    readings: Mapping[str, str]

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

    def spec(self, at: Mapping[str, float], seed: int) -> dict[str, Any]:
        """Run spec of the one grain at {input: value}."""
        grain = {k: at[f"grain_{s}"] for k, s in _FRICTIONS.items()}
        wall = {k: at[f"wall_{s}"] for k, s in _FRICTIONS.items()}
        both = {"restitution": at["restitution"]}
        spec = {
            "experiment": self.experiment,
            "seed": seed,
            "materials": {"particle": _MATERIAL},
            "contacts": {"particle_particle": grain | both, "particle_wall": wall | both},
            **self.run(at, 1e3 * DIAMETER),
        }
        spec["particles"] |= {"diameter_mm": 1e3 * DIAMETER, "elongation": at["elongation"]}
        if at["bond_number"]:
            energy = at["bond_number"] * energy_of_weight(DIAMETER, DENSITY)
            keys = "surface_energy_J_m2", "wall_surface_energy_J_m2"
            spec |= {"laws": {"cohesion": "jkr"}, "law_parameters": dict.fromkeys(keys, energy)}
        return spec


_FRICTIONS = {"static_friction": "friction", "rolling_friction": "rolling"}
_MATERIAL = {
    "density_kg_m3": DENSITY, "shear_modulus_Pa": SOFTNESS * DENSITY * GRAVITY * DIAMETER
}  # fmt: skip


def energy_of_weight(diameter: float, density: float) -> float:
    """Surface energy [J/m2] g at which the pull-off force of two grains of a diameter [m] and a
    density [kg/m3], 3 pi g R* with R* a quarter of the diameter, is the weight of one (Johnson,
    Kendall, Roberts 1971)."""
    return density * GRAVITY * diameter**2 / 4.5


def _grains(volume):
    """Grains in a volume of the bed, in diameters."""
    return round(filling(volume, 1.0))


def grains_of_cone(plate: float) -> float:
    """Grains of a cone of 35° on a plate, which is in diameters."""
    return filling(math.pi / 24.0 * CONE_SLOPE * plate**3, 1.0)


def relative_length(elongation: float) -> float:
    """Length of a grain, in diameters of the sphere of its volume."""
    return float(elongation * sphere_radius(1.0, elongation))


def _length(at):
    return relative_length(at["elongation"])


def _depth(count, wide):
    """Depth of grains over the width of their cylinder, which is in diameters."""
    return count / filling(math.pi / 4.0 * wide**3, 1.0)


def _heap(at, mm):
    plate = at["plate"]
    orifice = at["orifice"] * _length(at)
    count = round(at["filling"] * grains_of_cone(plate))
    d = 1e-3 * mm
    rate = at["feed"] * solid_rate(orifice * d, _length(at) * d) / (math.pi / 6.0 * d**3)
    geometry = {
        "orifice_diameter_mm": orifice * mm,
        "funnel_top_diameter_mm": (orifice + 20.0) * mm,
        "plate_diameter_mm": plate * mm,
        "discharge_height_mm": at["height"] * 0.5 * plate * mm,
        "generation_rate_per_s": rate,
        "injection_speed_m_s": 2.0 * math.sqrt(GRAVITY * d),
    }
    return {
        "particles": {"count": count},
        "geometry": geometry,
        "numerics": {"max_time_s": count / rate + 6.0 * math.sqrt(d / DIAMETER)},
    }


def _read_heap(spec, d, length):
    g, plate = spec.geometry, spec.geometry.plate_diameter_mm / d
    passes = solid_rate(1e-3 * g.orifice_diameter_mm, 1e-3 * length * d)
    rate = g.generation_rate_per_s * math.pi / 6.0 * (1e-3 * d) ** 3
    return {
        "plate": plate,
        "filling": spec.particles.count / grains_of_cone(plate),
        "height": g.discharge_height_mm / (0.5 * g.plate_diameter_mm),
        "orifice": g.orifice_diameter_mm / (length * d),
        "feed": 1.0 if g.feed == "opened" else rate / passes,
    }


def _cylinder(at, mm):
    wide = at["cylinder"] * _length(at)
    geometry = {
        "cylinder_diameter_mm": wide * mm,
        "plate_diameter_mm": 6.0 * wide * mm,
        "lift_speed_mm_s": 1e3 * at["lift_speed"] * math.sqrt(1e-3 * GRAVITY * mm),
    }
    count = _grains(math.pi / 4.0 * wide**3 * at["depth"])
    return {"particles": {"count": count}, "geometry": geometry}


def _read_cylinder(spec, d, length):
    wide = spec.geometry.cylinder_diameter_mm / d
    return {
        "cylinder": wide / length,
        "depth": _depth(spec.particles.count, wide),
        "lift_speed": 1e-3 * spec.geometry.lift_speed_mm_s / math.sqrt(GRAVITY * 1e-3 * d),
    }


def _vessel(at, mm):
    wide = at["vessel"] * _length(at)
    count = _grains(math.pi / 4.0 * wide**3 * at["depth"])
    return {"particles": {"count": count}, "geometry": {"vessel_diameter_mm": wide * mm, "taps": 0}}


def _read_vessel(spec, d, length):
    wide = (spec.geometry.simulated_diameter_mm or spec.geometry.vessel_diameter_mm) / d
    return {"vessel": wide / length, "depth": _depth(spec.particles.count, wide)}


def _silo(at, mm):
    orifice = at["orifice"] * _length(at)
    wide = at["silo"] * orifice
    geometry = {
        "silo_diameter_mm": wide * mm,
        "orifice_diameter_mm": orifice * mm,
        "hopper_half_angle_deg": at["half_angle_deg"],
    }
    count = _grains(math.pi / 4.0 * wide**2 * 1.9 * orifice)
    return {"particles": {"count": count}, "geometry": geometry}


def _read_silo(spec, d, length):
    g = spec.geometry
    return {
        "orifice": g.orifice_diameter_mm / (length * d),
        "silo": g.silo_diameter_mm / g.orifice_diameter_mm,
        "half_angle_deg": g.hopper_half_angle_deg,
    }


def _drum(at, mm):
    wide, width = at["drum"] * _length(at), at["width"] * _length(at)
    speed = math.sqrt(at["froude"] * GRAVITY / (0.5e-3 * wide * mm))
    geometry = {
        "drum_diameter_mm": wide * mm,
        "drum_width_mm": width * mm,
        "rotation_rate_deg_s": math.degrees(speed),
        "start_turns": 0.3,
        "turns": 0.25,
    }
    count = _grains(at["filling"] * math.pi / 4.0 * wide**2 * width)
    return {"particles": {"count": count}, "geometry": geometry}


def _read_drum(spec, d, length):
    g, radius = spec.geometry, 0.5e-3 * spec.geometry.drum_diameter_mm
    room = math.pi / 4.0 * (g.drum_diameter_mm / d) ** 2 * g.drum_width_mm / d
    return {
        "drum": g.drum_diameter_mm / (length * d),
        "width": g.drum_width_mm / (length * d),
        "filling": spec.particles.count / filling(room, 1.0),
        "froude": math.radians(g.rotation_rate_deg_s) ** 2 * radius / GRAVITY,
    }


_HEAP = dict.fromkeys(("angle_of_repose_deg", "radial_angle_deg"), "angle or share")
_HEAP |= {"height_mm": "length"}
RIGS = {
    rig.name: rig
    for rig in (
        Rig("heap", "heap", "heap of a funnel", _heap, _read_heap, _HEAP),
        Rig("cylinder", "lifted_cylinder", "heap of a lifted cylinder", _cylinder, _read_cylinder,
            _HEAP | {"base_radius_mm": "length"}),
        Rig("density", "bulk_density", "poured density", _vessel, _read_vessel,
            {"poured_density_kg_m3": "density", "poured_solid_fraction": "angle or share"}),
        Rig("silo", "discharge", "discharge of a silo", _silo, _read_silo,
            {"mass_flow_g_s": "mass flow", "bulk_density_kg_m3": "density"}),
        Rig("drum", "drum", "turning drum", _drum, _read_drum,
            {"dynamic_angle_deg": "angle or share"}),
    )
}  # fmt: skip
