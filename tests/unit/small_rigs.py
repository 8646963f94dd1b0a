"""What runs that take seconds share."""

ROUGH = {
    "particle_particle": {"restitution": 0.55, "static_friction": 0.85, "rolling_friction": 0.1},
    "particle_wall": {"restitution": 0.4, "static_friction": 0.7, "rolling_friction": 0.35},
}
"""Contacts of grains that pile up in these rigs."""
RIGS = {
    "bulk_density": ({"count": 300}, {"vessel_diameter_mm": 14, "taps": 2}),
    "compression": (
        {"count": 125},
        {"box_width_mm": 10, "box_height_mm": 30, "lid_travel_mm": 29, "packing": "cubic"},
    ),
    "discharge": (
        {"count": 1900, "diameter_mm": 2.0},
        {"silo_diameter_mm": 29, "orifice_diameter_mm": 11.2},
    ),
    "draw_down": (
        {"count": 600},
        {
            "upper_width_mm": 36,
            "lower_width_mm": 44,
            "depth_mm": 6,
            "slot_width_mm": 16,
            "fall_height_mm": 30,
        },
    ),
    "drop": ({}, {"drops": 2}),
    "drum": (
        {"count": 300},
        {"drum_diameter_mm": 30, "drum_width_mm": 8, "rotation_rate_deg_s": 180},
    ),
    "heap": (
        {"count": 700, "diameter_mm": 4.0},
        {"orifice_diameter_mm": 30, "generation_rate_per_s": 1400},
    ),
    "lifted_cylinder": ({"count": 500}, {"cylinder_diameter_mm": 16, "plate_diameter_mm": 80}),
    "shear": (
        {"count": 700, "diameter_mm": 2.0},
        {"inner_diameter_mm": 12, "outer_diameter_mm": 28, "normal_stress_kPa": 1}
        | {"preshear_displacement_mm": 2, "shear_displacement_mm": 3},
    ),
    "tilt": ({}, {"trials": 1}),
    "wall_friction": ({"count": 200}, {"ring_diameter_mm": 14, "slide_mm": 2}),
}
"""Experiment: (grains, geometry), beside the defaults."""
