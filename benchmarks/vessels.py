"""What the width of a rig does to what is read in it: `python -m benchmarks.vessels RUNS OUT`.

Makes the runs that RUNS does not have of this engine and writes `density.csv` and `rigs.csv` into
OUT, a row a run. The kept tables are in results/reference/vessels, with the plan that was stated
before the runs.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from dem.experiments import bed
from dem.run import run
from dem.spec import parse_spec

GRAIN, DENSITY = 3.0, 1200.0  # mm, kg/m3
POINTS = {"p1": (0.5, 0.2), "p2": (0.3, 0.05), "p3": (0.7, 0.6)}
"""Name -> friction and rolling friction between grains."""
SIZES = {"by": "mass", "diameters_mm": [2.1, 3.0, 3.9], "fractions": [0.25, 0.5, 0.25]}
BEDS = [(8, 7.2), (10, 9), (12, 10.8), (15, 13.5), (20, 18), (25, 22.5), (10, 18), (15, 9), (20, 9)]
"""Widths and depths, in grains."""
EDGES = 1.5, 2.0, 2.5, 3.0  # grains that a core keeps from wall, floor and surface
SEEDS = 1, 2, 3, 4
READ = {
    "shear": "shear_stress_kPa",
    "wall": "wall_friction_angle_deg",
    "silo": "mass_flow_g_s",
    "cyl": "angle_of_repose_deg",
}


def spec_of(experiment, point, seed, particles, geometry, **numerics):
    """Run spec of a test, softened as `dem new` softens."""
    friction, rolling = POINTS[point.rstrip("s")]
    common = {"restitution": 0.5, "rolling_friction": rolling}
    return parse_spec({
        "experiment": experiment,
        "seed": seed,
        "materials": {
            "particle": {"density_kg_m3": DENSITY, "shear_modulus_Pa": 3e6, "poisson_ratio": 0.3},
        },
        "contacts": {
            "particle_particle": common | {"static_friction": friction},
            "particle_wall": common | {"static_friction": 0.4},
        },
        "laws": {"rolling": "elastic_plastic", "torsion": "marshall"},
        "particles": particles,
        "geometry": geometry,
        "numerics": {"rayleigh_fraction": 0.35} | numerics,
    })  # fmt: skip


def poured(point, width, depth, seed):
    """Run spec of a bed; points that end in s have grains of three sizes."""
    count, grain = 0.9 * width**2 * depth, {"diameter_mm": GRAIN}
    if point.endswith("s"):
        d, share = (np.array(SIZES[k]) for k in ("diameters_mm", "fractions"))
        count, grain = count * GRAIN**3 * (share / d**3).sum(), {"sizes": SIZES}
    geometry = {"vessel_diameter_mm": width * GRAIN, "taps": 0}
    particles = {"count": round(count)} | grain
    return spec_of("bulk_density", point, seed, particles, geometry, max_time_s=5)


def rig(name, point, wider, seed):
    """Run spec of a rig as `dem new` writes it, `wider` times as many grains wide."""
    d, wide = GRAIN, 45.0 * wider
    if name == "cyl":
        d = (0.9 * 50**2 * 75 / 4000) ** (1 / 3) / wider
    experiment, count, geometry, numerics = {
        "shear": ("shear", 1300 * wider**2, {
            "normal_stress_kPa": 2, "inner_diameter_mm": 10 * d * wider,
            "outer_diameter_mm": 22 * d * wider, "shear_speed_mm_s": 15 * d,
            "preshear_displacement_mm": 2 * d, "shear_displacement_mm": 3 * d,
        }, {"overlap_limit": 0.8, "rayleigh_fraction": 0.2}),
        "wall": ("wall_friction", 800 * wider**2, {
            "normal_stress_kPa": 2, "ring_diameter_mm": 12 * d * wider,
            "slide_speed_mm_s": 10 * d, "slide_mm": 2 * d,
        }, {"rayleigh_fraction": 0.2}),
        "silo": ("discharge", 0.55 * 1.5 * wide**2 * 43.2 / d**3, {
            "orifice_diameter_mm": 18, "silo_diameter_mm": wide,
        }, {"max_time_s": 15}),
        "cyl": ("lifted_cylinder", 4000 * wider**3, {
            "cylinder_diameter_mm": 50, "plate_diameter_mm": 200, "lift_speed_mm_s": 20,
        }, {"max_time_s": 5}),
    }[name]  # fmt: skip
    particles = {"count": round(count), "diameter_mm": d}
    return spec_of(experiment, point, seed, particles, geometry, **numerics)


def densities(folder, width):
    """Mass over volume and density of the core with each edge [kg/m3] of a bed so many grains
    wide."""
    state = np.load(folder / "final.npz")
    place, radius = state["position"] - state["wall_origin"][0], state["radius"]
    half = 0.5e-3 * (width * GRAIN)
    level = float(np.sort(place[:, 2])[int(0.95 * len(place)) - 1])
    mass = DENSITY * 4.0 / 3.0 * math.pi * float((radius[place[:, 2] <= level] ** 3).sum())
    found = {"mass_over_volume_kg_m3": mass / (math.pi * half**2 * level)}
    for edge in EDGES:
        away = 2.0 * edge * float(radius.mean())
        core = half - away, away, level - away
        solid = bed.solid_fraction(place, radius, radius**3, *core)
        found[f"core_{edge:g}_kg_m3"] = DENSITY * solid
    return found


def main(runs: Path, out: Path) -> None:
    """Make the runs and write both tables."""
    beds, rigs = [], []
    for point in (*POINTS, "p1s"):
        for width, depth in BEDS:
            for seed in SEEDS:
                folder = runs / f"{point}-w{width:g}-h{depth:g}-{seed}"
                run(poured(point, width, depth, seed), folder, again=False)
                row = {"point": point, "width": width, "depth": depth, "seed": seed}
                beds.append(row | densities(folder, width))
    for name, metric in READ.items():
        for point in ("p1", "p2"):
            for wider in (1.0, 1.5):
                for seed in SEEDS[:3]:
                    folder = runs / f"{name}-{point}-{wider:g}-{seed}"
                    found = run(rig(name, point, wider, seed), folder, again=False)["metrics"]
                    row = {"rig": name, "point": point, "wider": wider, "seed": seed}
                    rigs.append(row | {"metric": metric, "value": found[metric]})
    pd.DataFrame(beds).round(2).to_csv(out / "density.csv", index=False)
    pd.DataFrame(rigs).round(4).to_csv(out / "rigs.csv", index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
