"""The one reader of tables: every way a spreadsheet writes the same numbers; values with units, and
questions about those without."""

import math
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.errors import ConfigError
from dem.spec import parse_spec
from dem.tables import read_table, table_of
from dem.units import UnitError, has_unit, in_unit, question, unit_of

VALUES = [26.1, 28.4, 27.0, 27.85]


def text(separator, decimal, line_end="\n"):
    rows = [["Gruppe", "Böschungswinkel"], *[[str(n), str(v)] for n, v in enumerate(VALUES, 1)]]
    written = line_end.join(separator.join(r) for r in rows) + line_end
    return "# gemessen am 3.4.\n" + written.replace(".", decimal)


ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "utf-32")


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(
    ("separator", "decimal"), [(";", ","), ("\t", ","), (",", "."), ("\t", ".")]
)
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_every_dialect_gives_the_same_numbers(tmp_path, encoding, separator, decimal, line_end):
    path = tmp_path / "Prüfung 1.csv"
    path.write_bytes(text(separator, decimal, line_end).encode(encoding))
    table = read_table(path)
    assert table.numbers("Böschungswinkel") == VALUES
    assert [line for line, _ in table.rows] == [3, 4, 5, 6]


@pytest.mark.parametrize(
    ("content", "value"),
    [
        ("angle\n26,1\n27,4\n", 26.1),  # one column: the comma can only be a decimal mark
        ("angle;\n26,1;\n", 26.1),
        ('angle,n\n"26,1",3\n', 26.1),
        ("sep=;\nangle;n\n26,1;3\n", 26.1),
        ("angle;n\n1.026,5;3\n", 1026.5),
        ('angle,n\n"1,026.5",3\n', 1026.5),
        ("angle;n\n0.845;3\n", 0.845),
        ("angle\n-2.5e-3\n", -2.5e-3),
    ],
)
def test_what_has_one_reading_is_read(content, value):
    assert table_of(content).numbers("angle")[0] == value


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("angle\n26,125\n27,250\n", ["line 2", "26.125", "26125", "thousands"]),
        ("angle\n1,26\n2,27\n3,28\n", ["line 2", "1.26", "1 and 26"]),
        ("group,angle\n1,26,1\n", ["line 2", "26,1", "26 and 1"]),
        ("a;n\n1.350;1\n", ["line 2", "1350"]),
        ("a;b,c\n1;2,3\n", ["line 1", "semicolon", "comma"]),
        ("g;a\n1;26,1\n2;27.1\n", ["line 2", "line 3", "mixes"]),
    ],
)
def test_what_has_two_readings_is_refused_with_both(content, words):
    with pytest.raises(ConfigError) as error:
        table_of(content)
    for word in words:
        assert word in str(error.value)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=6), st.sampled_from(["\t", ";"]))
def test_no_decimal_mark_changes_a_number(values, separator):
    """What is read is what was written, or the table is refused as readable in two ways."""
    for decimal in ".,":
        rows = "".join(f"1{separator}{v!r}\n".replace(".", decimal) for v in values)
        with suppress(ConfigError):
            assert table_of(f"n{separator}v\n{rows}").numbers("v") == values
    decisive = f"n{separator}v\n1{separator}0,5\n{rows}"
    assert table_of(decisive).numbers("v") == [0.5, *values]


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
