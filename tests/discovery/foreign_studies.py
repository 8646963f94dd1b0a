"""The studies by which the tables of `foreign/` are diagnosed: a rig, a table of factors and a
budget of runs; no settings of the diagnosis are written."""

import sys
from pathlib import Path

from calibration.study.config import overlay

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_heap import RUN

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
HEAPS = {"experiment": "heap", "target": {"metric": "angle_of_repose_deg"}, "run": RESTING}
SILOS = {"experiment": "discharge", "target": {"metric": "mass_flow_g_s"}, "run": SILO}
SHEARS = {"experiment": "shear", "target": {"metric": "shear_stress_kPa"}, "run": SHEAR}
DENSITIES = {
    "experiment": "bulk_density",
    "target": {"metric": "poured_density_kg_m3"},
    "run": DENSITY,
}


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
