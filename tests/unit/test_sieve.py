"""A sieve curve from a table: its grains have its shares by mass and by number, and a wrong table
is one sentence."""

import numpy as np
import pytest

from dem.grains.sizes import draw_radii, grain_volume, mean_radius
from dem.spec import content_hash, parse_spec

CURVE = "diameter_mm,passing_percent\n0.5,0\n1,20\n2,70\n5,100\n"
SIEVES, PASSING = np.array([0.5, 1.0, 2.0, 5.0]), np.array([0.0, 0.2, 0.7, 1.0])


def spec(path, by="mass"):
    """A heap of the table's grains."""
    particles = {"count": 20_000, "sizes": {"file": str(path), "by": by}}
    geometry = {"orifice_diameter_mm": 30}
    return parse_spec({"experiment": "heap", "particles": particles, "geometry": geometry})


@pytest.mark.parametrize("by", ["mass", "number"])
def test_the_grains_drawn_lie_on_the_curve(tmp_path, by):
    path = tmp_path / "sieve.csv"
    path.write_text(CURVE)
    parsed = spec(path, by)
    d = 2e3 * draw_radii(parsed, 20_000, np.random.default_rng(1))
    weight = d**3 if by == "mass" else np.ones_like(d)
    at = np.linspace(0.6, 4.9, 30)
    found = [weight[d <= x].sum() / weight.sum() for x in at]
    # a grain of 5 mm is 0.1 % of the mass here: the coarse end is met to its grains
    assert np.abs(found - np.interp(at, SIEVES, PASSING)).max() < 0.01
    assert 1e3 * mean_radius(parsed) == pytest.approx(0.5 * d.mean(), rel=0.01)
    assert 1e9 * grain_volume(parsed) == pytest.approx((np.pi / 6 * d**3).mean(), rel=0.02)


def test_a_run_is_named_after_the_sizes_and_not_after_the_file(tmp_path):
    one, two, other = (tmp_path / f"{n}.csv" for n in "abc")
    one.write_text(CURVE)
    two.write_text("# sieved on Monday\n" + CURVE)
    other.write_text(CURVE.replace("70", "71"))
    assert content_hash(spec(one)) == content_hash(spec(two)) != content_hash(spec(other))


def test_single_sizes_are_as_the_lists_would_give_them(tmp_path):
    path = tmp_path / "sizes.csv"
    path.write_text("diameter_mm,fraction\n1,0.25\n2,0.75\n")
    assert spec(path).particles.sizes.diameters_mm == [1.0, 2.0]
    assert spec(path).particles.sizes.fractions == [0.25, 0.75]
