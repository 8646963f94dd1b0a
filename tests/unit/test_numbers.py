"""No zero has a sign and no spread is written as zero, in sentences, tables and pages."""

import re
from pathlib import Path

import pytest

from calibration.figures import response_of
from calibration.statistics.numbers import fixed, signed, spread
from calibration.telling.report.embed import cell

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "config/*.md", "data/*/README.md", "docs/*.md", "examples/*/README.md")
SIGNED_ZERO = re.compile(r"(?<![\w.)^\]])[-−]0(\.0+)?(?!\.?\d)")
NO_SPREAD = re.compile(r"± ?0(\.0+)?(?![\d.])")


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


def test_the_patterns_find_what_they_look_for():
    for text in ("-0.0", "−0", "(-0.00 to 1)", "x −0.000 y"):
        assert SIGNED_ZERO.search(text), text
    for text in ("-0.44", "−0.15°", "0.0", "10-0", "-0.001", "file-0.1.0"):
        assert not SIGNED_ZERO.search(text), text
    for text in ("± 0.000", "±0", "± 0.0 mm"):
        assert NO_SPREAD.search(text), text
    for text in ("± 0.803", "± 0.00004", "±0.9"):
        assert not NO_SPREAD.search(text), text


@pytest.mark.parametrize(
    "page", sorted(p.relative_to(ROOT).as_posix() for x in PAGES for p in ROOT.glob(x))
)
def test_no_page_has_one(page):
    text = (ROOT / page).read_text("utf-8")
    assert not SIGNED_ZERO.findall(text)
    assert not NO_SPREAD.findall(text)
