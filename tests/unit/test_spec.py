"""Specs: defaults, where an error is, what a hash stands for, and what a valid spec is warned
of."""

import pytest
import yaml

from dem.advice import warnings_of
from dem.spec import GEOMETRY, content_hash, parse_spec
from dem.template import template
from dem.timescales import rayleigh_time
from facts import tells


@pytest.mark.parametrize("experiment", sorted(GEOMETRY))
def test_the_template_holds_exactly_the_defaults(experiment):
    text = template(experiment)
    assert parse_spec(yaml.safe_load(text)) == parse_spec({"experiment": experiment})
    assert all("#" in line or line.endswith(":") for line in text.splitlines()[3:])


def test_the_hash_stands_for_the_result():
    base = {"experiment": "heap", "seed": 3}
    reference = content_hash(parse_spec(base))
    assert content_hash(parse_spec(base | {"output": {"frame_interval_s": 0.1}})) == reference
    assert content_hash(parse_spec(base | {"particles": {"count": 10000}})) == reference
    assert content_hash(parse_spec(base | {"seed": 4})) != reference
    assert content_hash(parse_spec(base | {"laws": {"rolling": "none"}})) != reference


def test_the_hash_of_a_mesh_is_that_of_its_content(tmp_path):
    hashes = []
    for name, content in (("a.stl", b"one"), ("b.stl", b"one"), ("c.stl", b"two")):
        (tmp_path / name).write_bytes(content)
        geometry = {"plate_stl": str(tmp_path / name)}
        hashes.append(content_hash(parse_spec({"experiment": "heap", "geometry": geometry})))
    assert hashes[0] == hashes[1] != hashes[2]
    geometry["meshes"] = (
        "open"  # a failure kept of the same mesh, refused for its holes, must not answer for it
    )
    assert content_hash(parse_spec({"experiment": "heap", "geometry": geometry})) != hashes[2]


@pytest.mark.parametrize(
    ("geometry", "warned"),
    [
        ({"generation_rate_per_s": 7000}, False),
        ({"generation_rate_per_s": 9000}, True),
        ({"generation_rate_per_s": 12000}, True),
        ({"generation_rate_per_s": 20000}, False),
        ({"generation_rate_per_s": 10000, "feed": "opened"}, False),
    ],
)
def test_a_feed_near_what_the_orifice_passes_is_warned_of(geometry, warned):
    """W = 0.58 x 0.6 rho sqrt(g) (20 mm - 1.4 x 2 mm)^(5/2): 10,100 grains of 2 mm a second."""
    found = warnings_of(parse_spec({"experiment": "heap", "geometry": geometry}))
    assert any("Beverloo" in sentence for sentence in found) == warned


def test_a_narrow_orifice_and_short_contacts_are_warned_of():
    narrow = parse_spec({"experiment": "heap", "particles": {"diameter_mm": 5}})
    assert tells(warnings_of(narrow)[0], "4.0", "grain")
    coarse = parse_spec({"experiment": "drop", "numerics": {"rayleigh_fraction": 0.4}})
    (sentence,) = warnings_of(coarse)
    assert "1.7 m/s" in sentence
    assert "numerics.rayleigh_fraction" in sentence


def test_a_cluster_that_tips_before_it_slides_is_warned_of():
    rough = {"experiment": "tilt", "contacts": {"particle_wall": {"static_friction": 1.2}}}
    assert "may tip" in warnings_of(parse_spec(rough))[0]
    assert warnings_of(parse_spec(rough | {"geometry": {"spacing_mm": 2.0}})) == []


def test_rayleigh_time_is_that_of_a_wave_around_half_the_sphere():
    """For a Poisson's ratio of 1/4 the wave's speed is 0.9194 of the shear wave's (Rayleigh 1885,
    exact root)."""
    radius, density, modulus = 1e-3, 2500.0, 1e7
    speed = 0.9194 * (modulus / density) ** 0.5
    assert rayleigh_time(radius, density, modulus, 0.25) == pytest.approx(
        3.14159265 * radius / speed, rel=5e-3
    )
