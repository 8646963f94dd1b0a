"""Rigs whose runs take seconds with grains of 1.6 mm, spheres or clumps: experiment -> grains,
geometry."""

ROUGH = {
    "particle_particle": {"restitution": 0.55, "static_friction": 0.85, "rolling_friction": 0.1},
    "particle_wall": {"restitution": 0.4, "static_friction": 0.7, "rolling_friction": 0.35},
}
"""Contacts of grains that pile up in these rigs."""

RIGS = {
    "compression": (
        {"count": 200},
        {"box_width_mm": 12, "box_height_mm": 30, "lid_travel_mm": 29, "normal_stress_kPa": 5},
    ),
    "drum": (
        {"count": 400},
        {
            "drum_diameter_mm": 40,
            "drum_width_mm": 9,
            "rotation_rate_deg_s": 180,
            "turns": 0.05,
            "start_turns": 0.1,
        },
    ),
    "lifted_cylinder": ({"count": 250}, {"cylinder_diameter_mm": 14, "plate_diameter_mm": 60}),
    "wall_friction": ({"count": 200}, {"ring_diameter_mm": 12, "slide_mm": 1}),
}
