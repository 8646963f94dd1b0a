"""What a law makes a result hold for is said: in the report and wherever a spec is known."""

import pytest

from answers import ANSWER
from calibration.figures import response_of
from calibration.telling.report.answer import answer
from dem.advice import limits_of
from dem.spec import parse_spec
from facts import tells


@pytest.mark.parametrize(
    ("laws", "mu_r", "limited"),
    [
        ({"rolling": "constant_torque"}, 0.2, True),
        ({"rolling": "constant_torque"}, 0.0, False),
        ({"rolling": "constant_torque_relative"}, 0.2, False),
        ({"rolling": "elastic_plastic", "torsion": "marshall"}, 0.2, False),
    ],
)
def test_the_own_spin_torque_holds_at_rest_alone(tmp_path, laws, mu_r, limited):
    pair = f"{{restitution: 0.5, static_friction: 0.5, rolling_friction: {mu_r}}}"
    chosen = ", ".join(f"{k}: {v}" for k, v in laws.items())
    text = (
        f"experiment: heap\nlaws: {{{chosen}}}\n"
        f"contacts: {{particle_particle: {pair}, particle_wall: {pair}}}\n"
    )
    (tmp_path / "exports").mkdir()
    (tmp_path / "exports" / "dem.yaml").write_text(text)
    (tmp_path / "answer").mkdir()
    (tmp_path / "answer" / "answer.json").write_text(ANSWER.model_dump_json())
    notes = answer(tmp_path, response_of("angle_of_repose_deg"))["notes"]
    assert any(tells(n, "constant_torque", "drum") for n in notes) == limited
    spec = {"experiment": "heap", "laws": laws}
    spec["contacts"] = {"particle_particle": {"rolling_friction": mu_r}}
    assert bool(limits_of(parse_spec(spec))) == limited
