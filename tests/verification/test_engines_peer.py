"""Other engines as a study's engine: a drop gives the coefficient of restitution, a heap comes to
rest.

The apex of a rebound is e^2 h, and LIGGGHTS and LAMMPS integrate the same law. The time step
resolves
the contact well, so what is left is their dashpot's own error.
"""

import numpy as np
import pytest

from calibration import engines
from calibration.errors import ConfigError
from dem.spec import parse_spec

pytestmark = pytest.mark.peer

RESTITUTION, HEIGHT = 0.6, 150.0
TOLERANCE = 0.01  # of the restitution: a force that may attract ends a contact a little late


def entry(name):
    """An engine's entry; skips the test where it is not installed."""
    try:
        return engines.entry_of(name)
    except ConfigError as error:
        pytest.skip(str(error))


def spec(experiment, **parts):
    return parse_spec(
        {
            "experiment": experiment,
            "seed": 1,
            "materials": {
                "particle": {
                    "density_kg_m3": 1200,
                    "shear_modulus_Pa": 3e6,
                    "poisson_ratio": 0.25,
                },
                "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
            },
            "contacts": {
                "particle_particle": {
                    "restitution": 0.5,
                    "static_friction": 0.6,
                    "rolling_friction": 0.2,
                },
                "particle_wall": {
                    "restitution": RESTITUTION,
                    "static_friction": 0.6,
                    "rolling_friction": 0.2,
                },
            },
            "laws": {"rolling": "elastic_plastic"},
        }
        | parts
    )


@pytest.mark.parametrize("name", ["liggghts", "lammps"])
def test_a_drop_rebounds_by_its_restitution(tmp_path, name):
    chosen = entry(name)
    run = spec(
        "drop",
        particles={"count": 1, "diameter_mm": 2.0},
        geometry={"drop_height_mm": HEIGHT},
        numerics={"rayleigh_fraction": 0.05},
    )
    metrics, _ = engines.engines()[name].simulate(run, tmp_path, chosen)
    assert metrics["effective_restitution"] == pytest.approx(RESTITUTION, rel=TOLERANCE)
    assert metrics["rebound_height_mm"] == pytest.approx(RESTITUTION**2 * HEIGHT, rel=2 * TOLERANCE)


@pytest.mark.parametrize("name", ["liggghts", "lammps"])
def test_a_heap_comes_to_rest_with_all_its_grains(tmp_path, name):
    chosen = entry(name)
    run = spec(
        "heap",
        particles={"count": 400, "diameter_mm": 5.8},
        geometry={
            "generation_rate_per_s": 1250,
            "orifice_diameter_mm": 32,
            "discharge_height_mm": 40,
        },
        numerics={"max_time_s": 3.0},
    )
    metrics, state = engines.engines()[name].simulate(run, tmp_path, chosen)
    assert metrics["on_plate"] + metrics["spilled"] == 400
    assert metrics["in_funnel"] == 0
    # the lowest grains lie on the plate, and none has sunk into it
    lowest = (state["position"][:, 2] - state["radius"])[state["position"][:, 2] > 0].min()
    assert abs(lowest) < 0.05 * 2.9e-3
    assert np.linalg.norm(state["velocity"], axis=1).max() < 0.15
    assert 5.0 < metrics["radial_angle_deg"] < 45.0
