"""The runs that two engines are compared by, with their margins.

Small rigs: a pair of runs takes seconds. Grains that pour scatter from seed to seed, and engines
that round otherwise scatter as seeds do; so a mean over seeds is compared. Drops and slides of
single grains hardly scatter: they see a small change of a law that a heap hides.
"""

import copy
from dataclasses import dataclass
from typing import Any

CONTACT = {"restitution": 0.5, "static_friction": 0.6, "rolling_friction": 0.2}
PAIRS = ("particle_particle", "particle_wall")
BASE = {
    "materials": {
        "particle": {"density_kg_m3": 1200, "shear_modulus_Pa": 3e6, "poisson_ratio": 0.25},
        "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
    },
    "contacts": {pair: dict(CONTACT) for pair in PAIRS},
    "laws": {"rolling": "elastic_plastic", "torsion": "marshall"},
}
HEAP = {
    "particles": {"count": 1000, "diameter_mm": 4.0},
    "geometry": {"orifice_diameter_mm": 28, "discharge_height_mm": 50},
}
RAIN = {"geometry": {"generation_rate_per_s": 800}, "numerics": {"max_time_s": 4.0}}
OPENED = {
    "geometry": {"feed": "opened", "funnel_top_diameter_mm": 110},
    "numerics": {"max_time_s": 6.0, "rayleigh_fraction": 0.2},
}
OWN_SPIN = {"laws": {"rolling": "constant_torque", "torsion": "none"}}
SILO = {
    "contacts": {pair: CONTACT | {"rolling_friction": 0.05} for pair in PAIRS},
    "particles": {"count": 3400, "diameter_mm": 4.0},
    "geometry": {"silo_diameter_mm": 66, "orifice_diameter_mm": 26},
}
CELL = {
    "particles": {"count": 700, "diameter_mm": 4.0},
    "geometry": {
        "inner_diameter_mm": 24,
        "outer_diameter_mm": 56,
        "preshear_displacement_mm": 4,
        "shear_displacement_mm": 10,
    },
}


@dataclass(frozen=True)
class Trial:
    """Runs of one experiment by both engines.

    name : in the table
    experiment : of the run spec
    metric : that is compared
    margin : of the mean difference, in the unit of the metric, or as a share of the old mean
    relative : whether the margin is such a share
    parts : mappings laid over `BASE`, one after the other
    """

    name: str
    experiment: str
    metric: str
    margin: float
    relative: bool
    parts: tuple

    def spec(self, seed: int) -> dict[str, Any]:
        """The run spec (a mapping) of a seed."""
        out = {"experiment": self.experiment, "seed": seed, **copy.deepcopy(BASE)}
        for part in self.parts:
            for key, values in part.items():
                out[key] = {**out.get(key, {}), **values}  # type: ignore[dict-item]
        return out


TRIALS = (
    Trial("heap, rained, own spin", "heap", "angle_of_repose_deg", 0.1, False,
          (HEAP, RAIN, OWN_SPIN)),
    Trial("heap, rained, type C", "heap", "angle_of_repose_deg", 0.1, False, (HEAP, RAIN)),
    Trial("heap, opened, type C", "heap", "angle_of_repose_deg", 0.1, False, (HEAP, OPENED)),
    Trial("discharge", "discharge", "mass_flow_g_s", 0.005, True, (SILO,)),
    Trial("shear", "shear", "steady_shear_stress_kPa", 0.01, True, (CELL,)),
    Trial("tilt", "tilt", "sliding_angle_deg", 0.02, False, ({"particles": {"diameter_mm": 4.0}},)),
    Trial("drop", "drop", "effective_restitution", 0.001, False,
          ({"particles": {"diameter_mm": 4.0}},)),
)  # fmt: skip
"""The margins are what a user's answer does not feel: 0.1 degree is a quarter of what a laboratory
knows of a mean angle, half a percent of a flow and one of a shear stress are below any balance's
and tester's repeatability; slides and drops give back their law's number, so their margins are what
a time step moves."""
