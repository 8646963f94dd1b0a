"""Grains and rig enlarged or made fine, gravity kept: the same run in its own units.

By dimensional analysis an experiment in which every length goes as h, every time as the root of h,
every stress as h and every density as 1 gives the same numbers (Feng, Han, Owen and Loughran 2009,
Engineering Computations 26, 599). Powers of four and their roots are powers of two, so no float
rounds otherwise, and the same seed must give the same run to the last bits. A length or a time of
the code itself, in metres or seconds, breaks that, and so does a number of fine grains that float32
does not hold.
"""

import pytest
from small_rigs import RIGS

from dem.experiments import experiments
from dem.run import run
from dem.spec import parse_spec
from dem.units import unit_of

LARGE, FINE = 4.0, 4.0**-4
TYPE_A = {"rolling": "constant_torque", "torsion": "none"}
TYPE_C = {"rolling": "elastic_plastic", "torsion": "marshall"}
POWERS = {
    "mm": 1.0,
    "s": 0.5,
    "1/s": -0.5,
    "°/s": -0.5,
    "mm/s": 0.5,
    "m/s": 0.5,
    "Pa": 1.0,
    "kPa": 1.0,
    "g/s": 2.5,
    "kg/m³": 0.0,
    "°": 0.0,
    None: 0.0,
}
"""Unit of a key -> power of h by which its number goes."""
CHAOTIC = ("compression", "draw_down")
"""Grains fall freely and slide for long there, or when the walls of a box are taken away. What
float32 leaves of a fine grain's force below 1e-19 N, whose square it does not hold, acts in the end
like another seed: their fine runs take float64."""


def spec_of(name, laws, precision):
    parts = {
        "particles": RIGS[name][0],
        "geometry": RIGS[name][1],
        "materials": {"particle": {"shear_modulus_Pa": 3e6}},
        "contacts": {
            "particle_particle": {"rolling_friction": 0.2, "static_friction": 0.7},
            "particle_wall": {"rolling_friction": 0.2, "static_friction": 0.7},
        },
        "laws": laws,
        "numerics": {"precision": precision},
    }
    return parse_spec({"experiment": name, "seed": 3} | parts)


def enlarged(part, h, key=""):
    """A part of a spec with each number in its place."""
    if isinstance(part, dict):
        return {k: enlarged(v, h, k) for k, v in part.items()}
    if isinstance(part, float | int) and not isinstance(part, bool):
        power = POWERS[unit_of(key)]
        return part * h**power if power else part
    return part


QUICK = ("heap-fine", "compression-large", "drop-large", "heap-large", "shear-large")
CASES = [
    pytest.param(name, h, laws, id=case, marks=() if case in QUICK else pytest.mark.slow)
    for name in experiments()
    for size, h, laws in (("large", LARGE, TYPE_A), ("fine", FINE, TYPE_C))
    for case in (f"{name}-{size}",)
]


@pytest.mark.parametrize(("name", "h", "laws"), CASES)
def test_an_experiment_of_another_size_is_the_same(tmp_path, name, h, laws):
    spec = spec_of(name, laws, "double" if h == FINE and name in CHAOTIC else "mixed")
    content = spec.model_dump(mode="json")
    other = parse_spec(content | {k: enlarged(v, h) for k, v in content.items() if k != "seed"})
    as_is, found = (run(s, tmp_path / n)["metrics"] for s, n in ((spec, "as_is"), (other, "other")))
    assert set(as_is) == set(found)
    for key, value in as_is.items():
        expected = value * h ** POWERS[unit_of(key)]
        assert found[key] == pytest.approx(expected, rel=1e-12, abs=0.0), key
