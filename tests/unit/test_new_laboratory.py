"""`dem new` from all tests of a laboratory: what the answers become, and that none is dropped.
Expected numbers are worked out by hand or from closed forms."""

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from new_studies import GRAVEL, POWDER, WHEAT, begun, measured, piloted, read

from calibration.errors import CalibrationError
from calibration.interface.commands import main
from calibration.runs.feasibility import check_ahead
from calibration.runs.progress import progress
from calibration.runs.runner import report
from calibration.study.config.joint import joint_targets
from calibration.study.factors import read_factors
from calibration.study.new.answers import separate
from calibration.study.new.grains import clump_of_axes
from calibration.study.new.methods import methods
from dem.errors import BlowUpError, RefusedStateError
from dem.grains.clump import fault, shape_of
from facts import ROOT, tells

OF_TWO = [*WHEAT[:6], "--grain", "4mm", *WHEAT[-2:]]
"""Two rigs, of which the pilot takes half as long."""


def test_wheat_becomes_four_rigs_on_one_calibration(here, capsys):
    config = begun("wheat", WHEAT)
    rigs = {name: rig.experiment for name, rig in config.tests.items()}
    assert rigs == {"cylinder": "lifted_cylinder", "vessel": "bulk_density", "drop_300_mm": "drop",
                    "plane": "tilt"}  # fmt: skip
    found = measured(config)
    angle = found["cylinder", "angle_of_repose_deg"]
    values = [26.1, 27.4, 28.0, 26.8, 27.9]
    assert angle.mean == pytest.approx(np.mean(values))
    assert angle.variance == pytest.approx(np.var(values, ddof=1) / 5)
    rebound = found["drop_300_mm", "rebound_height_mm"]
    assert (rebound.mean, rebound.variance) == pytest.approx((78.0, 16.0 / 10))
    assert found["vessel", "poured_density_kg_m3"].mean == pytest.approx(765.0)
    assert found["plane", "sliding_angle_deg"].mean == pytest.approx(21.0)
    assert config.tests["drop_300_mm"].run["geometry"]["drop_height_mm"] == 300
    # (6.2 * 3.3 * 2.9) ** (1/3) = 3.900 mm
    assert config.tests["drop_300_mm"].run["particles"]["diameter_mm"] == pytest.approx(
        3.900, abs=5e-4
    )
    factors = {f.key: f for f in read_factors(config.factors)}
    wall = factors["contacts.particle_wall.restitution"]
    assert wall.centre == pytest.approx(math.sqrt(78 / 300), abs=1e-3)
    assert "78 mm" in wall.description
    friction = factors["contacts.particle_wall.static_friction"]
    assert friction.centre == pytest.approx(math.tan(math.radians(21)), abs=1e-3)
    assert config.own_run["particles"]["clump"]["file"] == "wheat/clump.csv"
    assert config.target.metric == "angle_of_repose_deg"
    check_ahead(config)
    said = capsys.readouterr().out
    assert tells(said, "assumed", "cylinder")
    assert joint_targets(config)[0].discrepancy > 0.0


def test_the_pilot_tells_the_time_that_a_dry_run_tells(here, monkeypatch, capsys):
    made = piloted(monkeypatch, lambda spec: {})
    assert main(["new", "wheat", *OF_TWO]) == 0
    assert {spec.experiment for spec in made} == {"lifted_cylinder", "bulk_density"}
    said = capsys.readouterr().out
    for resolution in ("quick", "full"):
        config = read("wheat", resolution=resolution)
        report(config)  # what -n prints
        told = capsys.readouterr().err.strip().removeprefix(f"{config.name}: ")
        left = re.search(r"about (.*) left", told)[1]
        assert tells(said, f"{resolution} profile", "2 cores")
        assert progress(config).sentence(2) in said
        assert left  # on one core, where nobody says how many


@pytest.mark.parametrize(
    ("angles", "runs", "facts"),
    [
        ((27.0, 28.0), 2, ["the ranges reach"]),
        pytest.param((20.0, 15.0, 28.0), 3, ["28°", "the ranges reach"], marks=pytest.mark.slow),
        ((20.0, 15.0, 24.0), 3, ["24°", "27.24°", "may not reach"]),
    ],
    ids=["between", "at the rough end", "beyond them"],
)
def test_the_pilot_says_whether_the_ranges_reach_what_was_measured(
    here, monkeypatch, capsys, angles, runs, facts
):
    poured = []

    def metrics(spec):
        if spec.experiment != "lifted_cylinder":
            return {}
        poured.append(spec.contacts.particle_particle)
        return {"angle_of_repose_deg": angles[len(poured) - 1]}

    piloted(monkeypatch, metrics)
    assert main(["new", "wheat", *OF_TWO]) == 0
    said = capsys.readouterr().out
    assert len(poured) == runs
    ends = {f.key: (f.low, f.high) for f in read_factors("wheat/factors.tsv")}
    place = "contacts.particle_particle"
    assert poured[1].static_friction == ends[f"{place}.static_friction"][0]
    if runs == 3:
        assert poured[2].static_friction == ends[f"{place}.static_friction"][1]
        assert poured[2].restitution == ends[f"{place}.restitution"][0]
    assert tells(said, "cylinder", *facts)


def test_a_rig_whose_grains_do_not_rest_is_changed_until_they_do(here, monkeypatch, capsys):
    def metrics(spec):
        smooth = spec.contacts.particle_particle.static_friction < 0.3
        if spec.experiment == "bulk_density" and smooth and spec.numerics.max_time_s < 5.0:
            raise RefusedStateError("restless", "filling: give numerics.max_time_s more")
        return {}

    piloted(monkeypatch, metrics)
    assert main(["new", "wheat", *OF_TWO]) == 0
    said = capsys.readouterr().out
    numerics = read("wheat").tests["vessel"].run["numerics"]
    assert numerics["max_time_s"] == 6.0  # 3 s by the experiment
    assert tells(said, "vessel", "max_time_s", "6", "rest")
    assert "calibration run" in said.splitlines()[-1]


def test_a_cylinder_that_is_told_counts_without_doubt(here, capsys):
    told = ["cylinder=60mm", "depth=80mm", "speed=15mm/s"]
    config = begun("wheat", [WHEAT[0], WHEAT[1], *told, *WHEAT[2:]])
    said = capsys.readouterr().out.splitlines()
    assert not [line for line in said if tells(line, "assumed", "cylinder")]
    assert joint_targets(config)[0].discrepancy == 0.0
    geometry = config.own_run["geometry"]
    assert (geometry["cylinder_diameter_mm"], geometry["lift_speed_mm_s"]) == (60.0, 15.0)


@pytest.mark.parametrize("options", [WHEAT, POWDER, GRAVEL], ids=["wheat", "powder", "gravel"])
def test_no_value_that_was_given_is_dropped(here, options):
    begun("own", options)
    given = pd.read_csv("own/given.csv", dtype=str)
    assert given["became"].notna().all()
    page = Path("own/README.md").read_text()
    values = [
        v
        for word in options
        if not word.startswith("--")
        for v in separate(word.split("=")[-1])
        if "x" not in v
    ]
    told = list(given["value"])
    for value in values:
        assert value in told, value
        told.remove(value)
        assert f"| {value} " in page


def test_a_moist_powder_sticks_and_is_said_to_be_coarse(here, capsys):
    config = begun("lime", POWDER)
    assert config.own_run["laws"]["cohesion"] == "jkr"
    factors = {f.key: f for f in read_factors(config.factors)}
    energy = factors["law_parameters.surface_energy_J_m2"]
    diameter = config.own_run["particles"]["diameter_mm"]
    # 3 pi g R/2 over the weight of a grain
    weight = math.pi / 6 * (1e-3 * diameter) ** 3 * 2700 * 9.81
    pulls = [1.5 * math.pi * g * 0.5e-3 * diameter / weight for g in (energy.low, energy.high)]
    assert pulls == pytest.approx([0.5, 12.5], rel=1e-2)
    sizes = {
        rig.run["particles"]["diameter_mm"] for n, rig in config.tests.items() if n != "cylinder"
    }
    assert sizes == {diameter}
    said = capsys.readouterr().out
    assert "jkr" in said
    assert "coarse grains" in said
    # at 0.3 of the Rayleigh time its vessel's grains trembled, at 0.24 they rested
    assert config.tests["vessel"].run["numerics"]["rayleigh_fraction"] <= 0.24
    loads = sorted(
        r.run["geometry"]["normal_stress_kPa"]
        for r in config.tests.values()
        if r.experiment == "shear"
    )
    assert loads == [2, 4, 6, 8]
    # the points scatter about their line by what four of them leave
    line = np.polyfit([2, 4, 6, 8], [1.9, 3.4, 4.8, 6.4], 1, full=True)
    sd = math.sqrt(line[1][0] / 2)
    found = measured(config)["shear_2_kPa", "shear_stress_kPa"]
    assert math.sqrt(found.variance) == pytest.approx(sd)
    check_ahead(config)


def test_fine_grains_stick_though_nobody_said_moist(here, capsys):
    fine = "--funnel 40 41 orifice=10mm plate=40mm height=40mm --density 2.7g/cm3".split()
    config = begun("flour", [*fine, "--grain", "0.05mm"])
    assert config.own_run["laws"]["cohesion"] == "jkr"
    flat = "--measured 40 41 --orifice 10mm --plate 40mm --height 40mm --density 2.7g/cm3".split()
    config = begun("flour2", [*flat, "--grain", "0.05mm"])
    assert config.own_run["laws"]["cohesion"] == "jkr"


def test_gravel_keeps_its_sieve_curve(here):
    config = begun("gravel", GRAVEL)
    sizes = config.own_run["particles"]["sizes"]
    assert sizes["fractions"] == [0.2, 0.4, 0.4]
    assert sizes["diameters_mm"] == pytest.approx([math.sqrt(x) for x in (8, 32, 128)], abs=1e-4)
    check_ahead(config)


def test_a_load_is_borne_without_deep_dents(here):
    """By Hertz: a grain of radius R under F = p (2 R)^2 is dented by (3 F / (4 E* sqrt(R*)))^(2/3),
    of which half is its own."""
    config = begun("lime", [w.replace("load=8kPa", "load=200kPa") for w in POWDER])
    modulus = config.own_run["materials"]["particle"]["shear_modulus_Pa"]
    assert modulus > 3e6
    radius, effective = 1.0, modulus / (2 * (1 - 0.25))
    force = 2e5 * (2 * radius) ** 2
    dent = (3 * force / (4 * effective * math.sqrt(radius / 2))) ** (2 / 3)
    assert 0.5 * dent <= 0.081 * radius


@pytest.mark.parametrize(
    ("axes", "spheres"),
    [((4, 3.9, 3.8), None), ((6.2, 3.3, 2.9), 3), ((10, 3, 3), 5), ((9, 8, 4), 7)],
)
def test_axes_become_a_clump_of_their_length_and_thickness(axes, spheres):
    """A rod has the volume of the ellipsoid, pi/6 L W T."""
    found = clump_of_axes(*axes)
    assert (found and len(found)) == spheres
    if found:
        assert fault(list(found)) is None
        low, high = (np.array([[c - s * r for c in xyz] for *xyz, r in found]) for s in (1, -1))
        extent = high.max(axis=0) - low.min(axis=0)
        if spheres < 7:
            assert 2 * shape_of(found).scale == pytest.approx(math.prod(axes) ** (1 / 3), rel=2e-2)
        assert extent[0] == pytest.approx(axes[0], rel=2e-2)
        assert axes[2] <= extent[2] * 1.001 <= axes[1] * 1.002


def of_vessel(name, *told):
    """Study, and geometry of its vessel, of oats of 4 mm."""
    options = "--lifted-cylinder 26 27 cylinder=60mm --density 1.3g/cm3 --grain 4mm".split()
    config = begun(name, [*options, "--bulk-density", "520kg/m3", "530kg/m3", *told])
    return config, config.tests["vessel"].run["geometry"]


def test_the_density_is_that_in_the_laboratorys_own_vessel(here, capsys):
    config, geometry = of_vessel("oats", "vessel=90mm")
    assert geometry == {"vessel_diameter_mm": 90.0, "simulated_diameter_mm": 60.0, "taps": 0}
    assert joint_targets(config)[1].discrepancy == 0.0
    assert not tells(capsys.readouterr().out, "vessel was not told")
    narrow, geometry = of_vessel("rye", "vessel=44mm")
    assert geometry == {"vessel_diameter_mm": 44.0, "taps": 0}
    check_ahead(narrow)
    config, geometry = of_vessel("peas")
    assert tells(capsys.readouterr().out, "vessel", "108.4 mm")
    assert geometry["vessel_diameter_mm"] == pytest.approx((4e6 / math.pi) ** (1 / 3), abs=0.1)
    # half of what its walls take: 0.7 grains over its width
    assert joint_targets(config)[1].discrepancy == pytest.approx(0.35 * 4 / 108.4 * 525, rel=0.05)


def test_taps_that_are_too_many_are_kept_and_no_target(here, capsys):
    tapped = ["--tapped-density", "810kg/m3", "812kg/m3", "taps=1250"]
    config = begun("wheat", [*WHEAT, *tapped])
    assert not [t for t in joint_targets(config) if t.test == "tapped"]
    table = pd.read_csv(config.measurements)
    assert list(table[table.quantity == "tapped_density"].role) == ["hold out"] * 2
    assert tells(capsys.readouterr().out, "1250 taps", "not simulated")
    config = begun("oats", [*WHEAT, *tapped[:-1], "taps=20"])
    assert [t.metric for t in joint_targets(config) if t.test == "tapped"] == [
        "tapped_density_kg_m3"
    ]
    assert config.tests["tapped"].run["geometry"]["taps"] == 20


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        ("--bulk-density 550kg/m3 552kg/m3", ["550 kg/m3", "0.42", "0.45"]),
        ("--lifted-cylinder 47 48 cylinder=60mm", ["47°", "1.07", "45°"]),
        # 0.58 * 0.55 * 1320 * 3.132 * (0.060 - 1.4 * 0.0039)**2.5 kg/s are 916 g/s
        ("--discharge 400g/s 401g/s orifice=60mm", ["400.5 g/s", "916 g/s", "60 mm"]),
    ],
)
def test_what_few_grains_do_is_asked_about_with_both_numbers(here, capsys, change, facts):
    option, *words = change.split()
    begun("wheat", _with(option, words) if option in WHEAT else [*WHEAT, option, *words])
    said = capsys.readouterr().out
    assert any(tells(line, *facts) for line in said.splitlines()), said


def _with(option, words):
    """WHEAT with other words behind an option."""
    at = WHEAT.index(option)
    end = next((k for k in range(at + 1, len(WHEAT)) if WHEAT[k].startswith("--")), len(WHEAT))
    return [*WHEAT[:at], option, *words, *WHEAT[end:]]


def test_length_and_width_make_a_spheroid(here, capsys):
    config = begun("wheat", _with("--axes", ["6.2x3.3mm", "6.0x3.1mm"]))
    assert tells(capsys.readouterr().out, "thickness", "spheroid")
    spheres = pd.read_csv("wheat/clump.csv")
    assert spheres["x_mm"].nunique() == len(spheres)  # a rod
    assert spheres["radius_mm"].max() == pytest.approx(3.2 / 2, rel=1e-3)
    volumes = [6.2 * 3.3**2, 6.0 * 3.1**2]
    own = config.tests["drop_300_mm"].run["particles"]["diameter_mm"]
    assert own == pytest.approx(np.mean(volumes) ** (1 / 3), abs=1e-3)


def test_a_time_of_a_mass_is_a_flow(here):
    timed = "--discharge time=1.0s time=1.1s mass=1kg orifice=60mm".split()
    config = begun("wheat", [*WHEAT, *timed])
    found = measured(config)["silo", "mass_flow_g_s"]
    assert found.mean == pytest.approx((1000 / 1.0 + 1000 / 1.1) / 2)


@pytest.mark.parametrize(
    ("text", "found"),
    [("26.1,27.4", ["26.1", "27.4"]), ("26,1", ["26,1"]), ("26,1;27,4", ["26,1", "27,4"]),
     ("26,27,28", ["26", "27", "28"]), ("1,234,567", ["1,234,567"]), ("1,32g/cm3", ["1,32g/cm3"])],
)  # fmt: skip
def test_commas_part_readings_or_are_decimal_marks(text, found):
    assert separate(text) == found


def test_each_method_declares_questions_that_read_their_own_examples():
    for method in methods().values():
        keys = [q.key for q in method.asked]
        assert len(keys) == len(set(keys))
        for q in method.questions:
            assert q.text
            if q.example:
                q.read(q.example)
        if method.becomes:
            assert method.readings
    with pytest.raises(CalibrationError, match="doubtful"):
        methods()["drop"].question("height").read("0.3")


GRAVEL_LIFTED = (
    "--lifted-cylinder 36 37 38 cylinder=150mm depth=150mm --density 2650kg/m3 --sieve sieve.csv "
    "--bulk-density 1500kg/m3 1520kg/m3"
).split()
GRAIN = "--density 1.32g/cm3 --grain 3.9mm --lifted-cylinder 26.1 27.4 28.0 cylinder=60mm".split()


def test_drops_from_several_heights_show_their_scatter_together(here):
    """Restitutions 0.50, 0.51 and 0.52: a standard deviation of 0.01 about 0.51."""
    drops = {300: 0.50, 200: 0.51, 100: 0.52}
    words = [w for h, e in drops.items() for w in ("--drop", f"{e**2 * h:.6f}mm", f"height={h}mm")]
    found = measured(begun("own", [*GRAIN, *words]))
    for height, restitution in drops.items():
        own = found[f"drop_{height}_mm", "rebound_height_mm"]
        rebound = restitution**2 * height
        assert own.mean == pytest.approx(rebound)
        assert own.variance**0.5 == pytest.approx(2 * 0.01 / 0.51 * rebound, rel=1e-4)
    factors = {f.key: f for f in read_factors("own/factors.tsv")}
    wall = factors["contacts.particle_wall.restitution"]
    # a fifth of the least and of the greatest
    assert (wall.low, wall.high) == pytest.approx((0.8 * 0.50, 1.2 * 0.52), abs=1e-4)


def test_what_bounces_write_is_taken_as_it_is(here):
    """The drops of a recording have each their own height."""
    sound = ROOT / "data/instruments/bounce_made.wav"
    assert main(["bounce", str(sound), "--out", "drops.csv"]) == 0
    config = begun("own", [*GRAIN, "--drop", "drops.csv", "wall=steel"])
    rows = pd.read_csv("drops.csv")
    found = {
        config.tests[rig].run["geometry"]["drop_height_mm"]: (m.mean, m.variance)
        for (rig, metric), m in measured(config).items()
        if metric == "rebound_height_mm"
    }
    assert len(found) == len(rows) > 1
    for row in rows.itertuples():
        assert found[row.drop_height_mm] == pytest.approx((row.value, row.sd**2 / row.n))
    check_ahead(config)


def test_wide_sizes_are_so_stiff_that_no_grain_is_squeezed_through(here, capsys):
    """By energy, at the stiffness that is told: the largest gravel that has fallen from the top of
    the fill squeezes the smallest by 0.7 of its radius, and one of a single size is not stiffer."""
    config = begun("own", GRAVEL_LIFTED)
    modulus = config.own_run["materials"]["particle"]["shear_modulus_Pa"]
    assert tells(capsys.readouterr().out, "shear modulus", f"{modulus:.1e} Pa")
    assert config.own_run["numerics"]["overlap_limit"] == 0.8
    quick = 4 ** (1 / 3) * config.own_run["particles"]["scale_factor"] * 1e-3
    sizes = config.own_run["particles"]["sizes"]["diameters_mm"]
    large, small = 0.5 * quick * max(sizes), 0.5 * quick * min(sizes)
    # a layer has a grain on each square of 2.15 radii that lies free in the cylinder of 150 mm
    a_layer = math.pi * (0.075 - 1.05 * large) ** 2 / (2.15 * large) ** 2
    height = config.own_run["particles"]["count"] / 4 / a_layer * 2.15 * large
    speed = math.sqrt(2 * 9.81 * height) + 3 * math.sqrt(9.81 * large)
    falls = 0.5 * 2650 * 4 / 3 * math.pi * large**3 * speed**2
    radius = small * large / (small + large)
    stored = 2 * 8 / 15 * modulus / 0.75 * math.sqrt(radius) * (0.7 * small) ** 2.5
    assert stored == pytest.approx(falls, rel=0.05)
    plain = [w for w in GRAVEL_LIFTED if w != "sieve.csv"]
    plain[plain.index("--sieve")] = "--grain"
    plain.insert(plain.index("--grain") + 1, "8mm")
    assert begun("one", plain).run["materials"]["particle"]["shear_modulus_Pa"] == 3e6


def test_a_rig_that_gives_no_value_is_no_next_step(here, monkeypatch, capsys):
    """Nor does the pilot tell what the runs take that end at once."""

    def metrics(spec):
        if spec.experiment == "bulk_density":
            raise BlowUpError(particle=1, time=0.1, reason="overlap", hint="the modulus")
        return {}

    piloted(monkeypatch, metrics)
    assert main(["new", "wheat", *OF_TWO]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert tells(last, "wheat", "vessel", "no value")
    assert not tells(last, "calibration run")
