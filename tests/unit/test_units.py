"""Values with units, and questions about those without: conversions set beside the definitions of
the units."""

import math

import pytest

from dem.spec import parse_spec
from dem.units import UnitError, has_unit, in_unit, question, unit_of


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1.35 g/cm3", "kg/m³", 1350.0),
        ("1.35 g/cm³", "kg/m³", 1350.0),
        ("1.35 kg/l", "kg/m³", 1350.0),
        ("15 mm", "mm", 15.0),
        ("1.5cm", "mm", 15.0),
        ("3.8 µm", "mm", 0.0038),
        ("1 in", "mm", 25.4),
        ("3 MPa", "Pa", 3e6),
        ("0.5 rad", "°", 0.5 * 180 / math.pi),
        ("27.4°", "°", 27.4),
        ("27.4 deg", "°", 27.4),
        ("0.04 J/m^2", "J/m²", 0.04),
        ("40 mN/m", "N/m", 0.04),
        ("1.8e-5 Pa s", "Pa·s", 1.8e-5),
        ("10 1/s", "1/s", 10.0),
        ("12", "mm", 12.0),
    ],
)
def test_units_are_converted(text, unit, value):
    assert in_unit(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["15 kg", "15 mmm", "15 mm mm", "27,4", "mm", "", "1 2", "15 __x__"]
)
def test_what_is_no_length_is_refused(text):
    with pytest.raises(UnitError):
        in_unit(text, "mm")


def test_keys_end_in_their_units():
    assert unit_of("density_kg_m3") == "kg/m³"
    assert unit_of("diameters_mm") == "mm"
    assert unit_of("tilt_rate_deg_s") == "°/s"
    assert unit_of("restitution") is None
    assert not has_unit("calibrated")
    assert not has_unit("1.9e9")


def test_a_spec_takes_units_at_any_depth():
    spec = parse_spec(
        {
            "experiment": "heap",
            "materials": {"particle": {"density_kg_m3": "1.35 g/cm3", "shear_modulus_Pa": "3 MPa"}},
            "particles": {
                "sizes": {"by": "mass", "diameters_mm": ["0.3 cm", 4], "fractions": [0.5, 0.5]}
            },
        }
    )
    assert spec.materials.particle.density_kg_m3 == 1350.0
    assert spec.materials.particle.shear_modulus_Pa == 3e6
    assert spec.particles.sizes.diameters_mm == [3.0, 4.0]


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("density_kg_m3", (25, 720, 1210, 2650, 7850, 19_300)),  # polystyrene foam to tungsten
        ("shear_modulus_Pa", (1e5, 3e6, 1.9e9, 8e10)),
        ("diameter_mm", (0.05, 0.5, 2, 60)),
        ("angle_of_repose_deg", (12, 27.4, 45.26, 70)),
        ("restitution", (0.1, 0.9)),
    ],
)
def test_what_materials_have_is_not_asked_about(key, values):
    assert [question(key, v) for v in values] == [None] * len(values)
