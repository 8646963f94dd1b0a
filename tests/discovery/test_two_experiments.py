"""Drop and tilt together: every mechanism that shows on them, and two effects at once."""

import pytest

MECHANISMS = (
    "viscoelastic_restitution",
    "plastic_restitution",
    "air_drag",
    "apex_sampling",
    "wall_adhesion",
    "tilt_detection_lag",
    "stress_dependent_friction",
)
CHANGES = {
    "runs_per_input": 8,
    "experiments": {
        "drop": {
            "runs_per_input": None,
            "mechanisms": [m for m in MECHANISMS[:5] if m != "apex_sampling"],
        },
        "heap": None,
        "shear": None,
    },
}
pytestmark = [pytest.mark.slow, pytest.mark.long]


@pytest.fixture(scope="module")
def both(tmp_path_factory, make_laboratory):
    return make_laboratory(tmp_path_factory.mktemp("runs"), CHANGES, MECHANISMS)[0]


def test_most_hidden_effects_are_named_first_and_hardly_any_is_named_wrongly(both):
    right, wrong = 0, 0
    for name in MECHANISMS:
        for point in range(2):
            data = both.measure(point, name)
            found = both.identify(data, 3)
            named = found.verdict in ("identified", "ambiguous")
            right += named and found.ranking[0]["mechanism"] == name
            wrong += found.verdict == "identified" and found.causes != [name]
    assert right >= 11  # of 14
    assert wrong <= 1


def test_two_effects_at_once_are_both_named(both):
    effects = ("air_drag", "stress_dependent_friction")
    found = [both.identify(both.measure(point, *effects), 3) for point in range(3)]
    assert sum(set(effects) <= set(f.causes) for f in found) >= 2
