"""A free law becomes the engine's curve: what the contact then does is what the law says."""

import numpy as np
import pytest
from diagnosis_cases import BASE

from benchmarks.rates.simulated import salt_settings
from calibration.intake.quantities import Condition
from dem.spec import parse_spec
from diagnosis.laws.engine_gain import has_curve, switched_on
from diagnosis.laws.known import rebounds, sliding_angles
from diagnosis.laws.slots import FAMILY
from diagnosis.rig import Rig

LAWS = {f"{law.experiment}:{law.slot}({', '.join(law.state)})": law for law in FAMILY}
RIG = Rig(salt_settings(), BASE)


def values(coefficient, low, high):
    """A curve as a verdict has it."""
    state = np.geomspace(low, high, 25)
    return [{"state": s, "value": v} for s, v in zip(state, coefficient(state), strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "coefficient", "low", "high"),
    [
        ("drop:restitution(speed)", lambda v: 0.8 - 0.08 * v, 0.7, 3.0),
        ("drop:restitution(size)", lambda d: 0.6 * d**0.2, 1.0, 4.0),
        ("drop:restitution(speed, size)", lambda s: 0.85 - 0.2 / s, 0.7, 12.0),
    ],
)
def test_a_rebound_is_that_of_the_laws_restitution(name, coefficient, low, high):
    law = LAWS[name]
    switch, middle = switched_on(law, values(coefficient, low, high))
    heights = np.array([30.0, 100.0, 400.0])
    for size in (1.0, 2.0, 4.0):
        levers = {"drop_height_mm": 100.0, "particle_diameter_mm": size}
        spec = switch(RIG.spec(Condition("drop", levers), 1), middle)
        at = {"drop_height_mm": heights, "particle_diameter_mm": np.full(3, size)}
        expected = coefficient(np.clip(law.coordinate(at), low, high)) ** 2 * heights
        # the dashpot's factor runs between the states, and the contact costs a little height
        assert rebounds(spec, heights) == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
def test_a_slide_is_that_of_the_laws_friction():
    law = LAWS["tilt:friction(size)"]
    switch, middle = switched_on(law, values(lambda d: 0.6 * d**-0.2, 1.0, 4.0))
    for size in (1.0, 2.3, 4.0):
        levers = {"tilt_rate_deg_s": 4.0, "particle_diameter_mm": size}
        spec = switch(RIG.spec(Condition("tilt", levers), 1), middle)
        expected = np.degrees(np.arctan(0.6 * size**-0.2))
        # a tenth of a degree more has passed when the slip is seen
        assert sliding_angles(spec, [4.0])[0] == pytest.approx(expected, abs=0.3)


def test_a_law_that_the_engine_lacks_has_no_curve():
    curves = {name for name, law in LAWS.items() if has_curve(law)}
    assert curves == {
        "drop:restitution(speed)",
        "drop:restitution(size)",
        "drop:restitution(speed, size)",
        "tilt:friction(size)",
    }


def test_the_keys_make_a_run_spec():
    law = LAWS["drop:restitution(speed)"]
    switch, middle = switched_on(law, values(lambda v: 0.8 - 0.08 * v, 0.7, 3.0))
    spec = parse_spec({"experiment": "drop", "geometry": {}} | switch({}, middle))
    assert spec.laws.damping == "restitution_curve"
    middle = spec.contacts.particle_wall.restitution
    last = middle * spec.law_parameters.wall_restitution_curve_5
    assert last == pytest.approx(0.8 - 0.08 * 3.0)
