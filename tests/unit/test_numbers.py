"""No zero has a sign and no spread is written as zero, in sentences, tables and pages."""

import pytest

from calibration.figures import response_of
from calibration.statistics.numbers import fixed, signed, spread
from calibration.telling.report.embed import cell


@pytest.mark.parametrize(
    ("value", "digits", "sign", "text"),
    [
        (-0.0004, 3, "+", "0.000"),
        (-0.04, 1, "", "0.0"),
        (0.5, 1, "+", "+0.5"),
        (-2.5, 1, "", "-2.5"),
    ],
)
def test_no_zero_has_a_sign(value, digits, sign, text):
    assert fixed(value, digits, sign) == text


@pytest.mark.parametrize(("value", "text"), [(0.0, "0"), (-0.0, "0"), (-1.5, "−1.5"), (2, "+2")])
def test_a_difference_has_a_sign_unless_it_is_none(value, text):
    assert signed(value) == text


@pytest.mark.parametrize(
    ("sd", "digits", "text"), [(0.8031, 3, "0.803"), (0.00004, 3, "0.00004"), (0.0002, 3, "0.0002")]
)
def test_no_spread_is_written_as_zero(sd, digits, text):
    assert spread(sd, digits) == text


@pytest.mark.parametrize("value", [-0.0, -1e-14])
def test_a_cell_of_the_report_has_no_signed_zero(value):
    assert cell(value) == "0"
    assert response_of("angle_of_repose_deg").value(value) == "0.00°"
