"""What is simulated with the real engine: the experiment as the emulators knew it, with laws that
go together."""

import numpy as np
import pytest
from diagnosis_cases import BASE, bench

from calibration.intake.measurements import Measurement
from dem.spec import parse_spec
from diagnosis.extend import real_spec
from diagnosis.rig import Rig, combine

KINDS = ["drop", "tilt", "shear", "heap"]
LEVERS = {
    "drop": {"drop_height_mm": 150.0},
    "tilt": {"tilt_rate_deg_s": 5.0},
    "shear": {"normal_stress_kPa": 4.0},
    "heap": {},
}
CONDITIONS = list(LEVERS.items())


@pytest.fixture(scope="module")
def emulated():
    none = {"mechanisms": []}
    return bench(KINDS, {"experiments": dict.fromkeys(KINDS, none), "runs": 200})


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_has_the_parameters_of_its_own_experiment_alone(emulated, kind):
    """The others stand where they stood when the emulator was trained, or base and gain would be of
    another model."""
    model = emulated.model(CONDITIONS)
    theta = np.linspace(-0.9, 0.9, len(model.factors))
    measured = Measurement(kind, 10.0, 1.0, 5, LEVERS[kind])
    spec = real_spec(Rig(emulated.settings, BASE), model, measured, theta, 1)
    found = {
        f"contacts.{pair}.{name}": value
        for pair, values in spec.get("contacts", {}).items()
        for name, value in values.items()
    }
    own = emulated.settings.experiments[kind]
    fixed = own.run.get("contacts", {})
    for factor, coded in zip(model.factors, theta, strict=True):
        _, pair, name = factor.key.split(".")
        if factor.key in own.parameters:
            assert found[factor.key] == pytest.approx(factor.natural(coded))
        else:
            assert found.get(factor.key) == fixed.get(pair, {}).get(name)


PAIRS = [
    ("plastic_restitution", "wall_adhesion", False),  # JKR has a normal force of its own
    ("viscoelastic_restitution", "plastic_restitution", False),  # both are the dashpot
    ("cohesion", "liquid_bridge", False),
    ("liquid_bridge", "wall_adhesion", False),
    ("plastic_restitution", "cohesion", True),  # on different experiments
    ("wall_adhesion", "stress_dependent_friction", True),
    ("air_drag", "plastic_restitution", True),
    ("apex_sampling", "plastic_restitution", True),
    ("cohesion", "size_bias", True),
]


@pytest.mark.parametrize(("first", "second", "together"), PAIRS)
def test_two_laws_are_offered_together_only_where_the_engine_can_have_both(
    emulated, first, second, together
):
    pair = [emulated.catalogue[n] for n in (first, second)]
    assert combine(emulated.settings, pair, CONDITIONS) is together
    assert combine(emulated.settings, pair[::-1], CONDITIONS) is together
    if together:
        model = emulated.model(CONDITIONS, [first, second])
        for kind, levers in CONDITIONS:
            measured = Measurement(kind, 10.0, 1.0, 5, levers)
            theta = np.full(len(model.names), 0.5)
            parse_spec(real_spec(Rig(emulated.settings, BASE), model, measured, theta, 1))


def test_a_pair_that_is_not_measured_together_goes_together(emulated):
    pair = [emulated.catalogue[n] for n in ("plastic_restitution", "wall_adhesion")]
    assert combine(emulated.settings, pair, [("tilt", LEVERS["tilt"])])
