"""A heap of 400 grains that LIGGGHTS and LAMMPS pour too, in seconds of one core."""

RUN = {
    "materials": {
        "particle": {"density_kg_m3": 1200, "shear_modulus_Pa": 3e6, "poisson_ratio": 0.25},
        "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
    },
    "contacts": {
        pair: {"restitution": 0.5, "static_friction": 0.6, "rolling_friction": 0.2}
        for pair in ("particle_particle", "particle_wall")
    },
    "laws": {"rolling": "elastic_plastic"},
    "particles": {"count": 400, "diameter_mm": 5.8},
    "geometry": {
        "generation_rate_per_s": 1250,
        "orifice_diameter_mm": 32,
        "discharge_height_mm": 40,
    },
    "numerics": {"max_time_s": 3.0},
}
SPEC = {"experiment": "heap", "seed": 1, **RUN}
