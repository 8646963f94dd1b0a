"""The ranges of a new study by the atlas: they shrink and hold the truth, and stay where the atlas
knows nothing of what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from new_studies import begun, piloted

from calibration.atlas.emulators import AtlasEmulators, cut_to_atlas, poured_as_atlas
from calibration.errors import CalibrationError
from calibration.interface.commands import main
from calibration.interface.estimate import LEAST, ranges_by_atlas
from calibration.statistics.design import screening_design
from calibration.study.factors import read_factors
from facts import refused, tells

ANGLE, SLOW = "angle_of_repose_deg", pytest.mark.slow
RIG = ["--grain=4mm", "--density=1.3g/cm3", "--orifice=40mm", "--plate=160mm"]
HEAP = [*RIG, "--height=100mm"]
SMALL = "--density 2.1g/cm3 --grain 2mm --orifice 20mm --plate 52mm --height 60mm".split()


def begun_with(name, *angles, rig=HEAP):
    """(configuration, factors) of a study of these angles."""
    config = begun(name, ["--measured", *(f"{a:.2f}" for a in angles), *rig])
    return config, read_factors(config.factors)


def standing(config, before, factors):
    """Mean log odds of no heap at the points of a screening over ranges."""
    own, _ = cut_to_atlas(config, before)
    chance = AtlasEmulators(config, own).formed("heap", ANGLE, 1).chance
    table = screening_design(factors, config.screening)
    levels = [
        (f.natural(table[f.code].to_numpy(float)) - o.low) / (o.high - o.low)
        for o in own for f in factors if f.name == o.name
    ]  # fmt: skip
    return chance.predict(np.column_stack(levels))[0].mean()


@pytest.mark.parametrize(
    "truth", [(0.7, 0.6, 0.3, 0.5, 0.5), pytest.param((0.5, 0.9, 0.4, 0.3, 0.8), marks=SLOW)]
)
def test_ranges_shrink_and_hold_the_truth(here, truth):
    config, factors = begun_with("any", 27.0, 28.0)
    own, _ = cut_to_atlas(config, factors)
    angle = AtlasEmulators(config, own).of("heap", ANGLE).mean(np.array([truth]))[0][0]
    config, factors = begun_with("peas", angle - 0.5, angle, angle + 0.5)
    found, said, tests = ranges_by_atlas(config, factors)
    levels = {f.name: f.low + u * (f.high - f.low) for f, u in zip(own, truth, strict=True)}
    pairs = [(f, new) for f, new in zip(factors, found, strict=True) if new != f]
    assert len(pairs) >= 2
    for old, new in pairs:
        assert old.low <= new.low <= levels[new.name] <= new.high <= old.high
        assert new.high - new.low >= (LEAST - 0.01) * (old.high - old.low)
        assert tells(new.description, old.description, "atlas", f"{old.low:g} to {old.high:g}")
        assert any(tells(s, new.name, new.levels) for s in said)
    assert tells(said[0], "atlas", f"{angle:.2f}°", "the ranges reach it")
    assert tests == ["heap"]
    assert standing(config, factors, found) < standing(config, factors, factors) - 0.3


@pytest.mark.parametrize(
    ("words", "why"),
    [("--height=400mm", ("height", "5", "2.5")), ("--height=99mm --rim=6mm", ("rim", "6.0"))],
)
def test_ranges_stay_outside_the_atlas(here, words, why):
    config, factors = begun_with("peas", 30, 31, rig=[*RIG, *words.split()])
    found, said, tests = ranges_by_atlas(config, factors)
    assert (found, tests) == (factors, [])
    assert len(said) == 1
    assert tells(said[0], "ranges stay", "outside the atlas", *why)


@pytest.mark.parametrize("angle", [15.0, 50.0])
def test_the_atlas_is_asked_for_as_many_grains_as_it_has(here, angle):
    config, factors = begun_with("peas", angle, angle + 1.0, rig=[*RIG, "--height=150mm"])
    assert AtlasEmulators(poured_as_atlas(config)[0], factors).tests == ["heap"]
    with refused(CalibrationError, "grains poured", "0.6 to 2"):
        AtlasEmulators(config, factors).told()


def test_an_angle_beyond_all_heaps_narrows_no_range_but_where_heaps_roll_off(here):
    config, factors = begun_with("peas", 46, 46.2, rig=SMALL)
    found, (reached, *_, why), tests = ranges_by_atlas(config, factors)
    assert tests == ["heap"]
    assert tells(reached, "46.10°", "may not reach")
    assert tells(reached, "--rim", "--height", "--rate")
    assert tells(reached, "--axes")
    assert tells(why, "atlas", "hardly any")
    for old, new in zip(factors, found, strict=True):
        assert new.high - new.low >= (LEAST - 0.01) * (old.high - old.low)
    assert standing(config, factors, found) <= standing(config, factors, factors)


def test_a_new_study_has_the_ranges_of_the_atlas(here, monkeypatch, capsys):
    """Its table, its page and the middle that is run agree."""

    def half(config, factors):
        cut = [replace(f, low=f.centre, description="cut") for f in factors]
        return cut, ["narrower"], ["heap"]

    seen = piloted(monkeypatch, lambda spec: {ANGLE: 20.0})
    monkeypatch.setattr("calibration.interface.estimate.ranges_by_atlas", half)
    assert main(["new", "peas", "--measured", "26", "27", *HEAP]) == 0
    factors = {f.name: f for f in read_factors("peas/factors.tsv")}
    friction = factors["grain_grain_static_friction"]
    assert (friction.low, friction.high) == (0.5, 0.8)
    assert [s.contacts.particle_particle.static_friction for s in seen] == [0.65, 0.5]
    said = capsys.readouterr().out
    assert tells(said, "narrower", "20° at the middle of the ranges", "measured 26.5°")
    assert "reach" not in said  # of a test of which the atlas told
    page = (here / "peas/README.md").read_text()
    assert tells(page, "Narrower")
    assert tells(page, "grain_grain_static_friction", "0.5", "0.8", "cut")
