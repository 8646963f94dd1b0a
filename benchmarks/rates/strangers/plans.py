"""What a laboratory sets: full plans of two to five levels a lever, and further columns."""

from itertools import product

import numpy as np

HEIGHTS = {
    2: (60.0, 240.0),
    3: (50.0, 120.0, 250.0),
    4: (50.0, 90.0, 150.0, 260.0),
    5: (40.0, 75.0, 130.0, 230.0, 400.0),
    "close": (80.0, 110.0, 150.0, 205.0),
}
SIZES = {2: (1.0, 3.0), 3: (1.0, 2.0, 4.0), 4: (1.0, 1.6, 2.5, 4.0), 5: (1.0, 1.4, 2.0, 2.8, 4.0)}
RATES = {
    2: (4.0, 16.0),
    3: (3.0, 7.0, 16.0),
    4: (2.0, 4.0, 9.0, 18.0),
    5: (2.0, 4.0, 8.0, 13.0, 20.0),
}
LOADS = {
    2: (1.0, 6.0),
    3: (1.0, 2.5, 6.0),
    4: (0.8, 1.6, 3.2, 6.4),
    5: (0.5, 1.0, 2.0, 4.0, 8.0),
}
FRAMES = (0.008, 0.02, 0.04)
"""Drop heights [mm], diameters [mm], tilt rates [deg/s], normal stresses [kPa], frame intervals
[s]."""

FURTHER = {
    "humidity_percent": (30.0, 80.0),
    "temperature_C": (5.0, 45.0),
    "impact_number": (0.0, 3000.0),
}
"""Range of each further column."""


def levers(
    experiment: str,
    levels: tuple,
    rng: np.random.Generator,
    column: str | None = None,
    frames: bool = False,
) -> dict[str, np.ndarray]:
    """{lever: (n,)} of a full plan, in the order of its levels; a shear cell has loads alone.

    levels: how many heights or rates, and how many sizes. column: a further column, drawn for each
    row. frames: drops of two sizes are filmed at three frame intervals.
    """
    if experiment == "shear":
        return {"normal_stress_kPa": np.array(LOADS[levels[0]])}
    lever, own = ("drop_height_mm", HEIGHTS) if experiment == "drop" else ("tilt_rate_deg_s", RATES)
    axes, names = [own[levels[0]], SIZES[levels[1]]], [lever, "particle_diameter_mm"]
    if frames:
        axes, names = [axes[0], SIZES[2], FRAMES], [*names, "output_interval_s"]
    rows = np.array(list(product(*axes)))
    x = dict(zip(names, rows.T, strict=True))
    if column:
        low, high = FURTHER[column]
        if column == "impact_number":  # it counts up, in an order of its own
            x[column] = rng.permutation(np.round(np.linspace(low, high, len(rows))))
        else:
            x[column] = np.round(rng.uniform(low, high, len(rows)), 1)
    return x
