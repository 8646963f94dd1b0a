"""The studies by which the tables of `foreign/` are diagnosed: a rig, a table of factors and a
budget of runs; no settings of the diagnosis are written."""

from typing import Any

from calibration.study.config import overlay

MATERIALS: dict[str, Any] = {
    "materials": {
        "particle": {"density_kg_m3": 1200, "shear_modulus_Pa": 3e6, "poisson_ratio": 0.25},
        "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
    },
    "contacts": {
        pair: {"restitution": 0.5, "static_friction": 0.6, "rolling_friction": 0.2}
        for pair in ("particle_particle", "particle_wall")
    },
}
RUN = MATERIALS | {
    "laws": {"rolling": "elastic_plastic"},
    "particles": {"count": 400, "diameter_mm": 5.8},
    "geometry": {
        "generation_rate_per_s": 1250,
        "orifice_diameter_mm": 32,
        "discharge_height_mm": 40,
    },
    "numerics": {"max_time_s": 3.0},
}
"""A heap of 400 grains that LIGGGHTS pours too, in seconds of one core."""

FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\tof grain and grain
B\tfriction\tcontacts.particle_particle.static_friction\t0.3\t0.8\tof grain and grain
C\twall_friction\tcontacts.particle_wall.static_friction\t0.3\t0.8\tof grain and wall
"""
FIXED = {"rolling": 0.2, "friction": 0.6, "wall_friction": 0.6}
GRAINS = {k: RUN[k] for k in ("materials", "contacts", "laws")}
SILO = GRAINS | {
    "particles": {"count": 2600, "diameter_mm": 2.0},
    "geometry": {"silo_diameter_mm": 32.5, "orifice_diameter_mm": 12.0},
    "numerics": {"max_time_s": 6.0},
}
SHEAR = GRAINS | {
    "particles": {"count": 800, "diameter_mm": 2.8},
    "geometry": {"normal_stress_kPa": 2.0},
}
DENSITY = GRAINS | {
    "particles": {"count": 700, "diameter_mm": 3.0},
    "geometry": {"vessel_diameter_mm": 24.0, "taps": 0},
}
# grains that nothing keeps from spinning about the vertical never come to rest
RESTING = RUN | {"laws": RUN["laws"] | {"torsion": "marshall"}}
HEAPS = {"tests": {"heap": {"experiment": "heap", "run": RESTING}}}
SILOS = {"tests": {"silo": {"experiment": "discharge", "run": SILO}}}
SHEARS = {"tests": {"cell": {"experiment": "shear", "run": SHEAR}}}
DENSITIES = {"tests": {"vessel": {"experiment": "bulk_density", "run": DENSITY}}}


def filled(run, diameter_mm):
    """A run with grains of another size, of the same volume together: what a vessel or a funnel is
    filled with, of any grains."""
    grains = run["particles"]
    count = round(grains["count"] * (grains["diameter_mm"] / diameter_mm) ** 3)
    return overlay(run, {"particles": {"count": count, "diameter_mm": diameter_mm}})


def study(name, what, measurements, runs):
    """Configuration of the diagnosis of a table."""
    return what | {
        "name": name,
        "factors": "factors.tsv",
        "measurements": str(measurements),
        "fixed": FIXED,
        "diagnosis": {"runs": runs, "batches": 2},
    }
