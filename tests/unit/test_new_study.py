"""`dem new` from a laboratory's values to a study that is checked; closed forms beside what it
computes."""

import math
from pathlib import Path

import numpy as np
import pytest
from new_studies import piloted, read

from calibration.intake.measurements import read_measured
from calibration.interface.commands import main
from calibration.study.config import point_spec
from calibration.study.config.joint import joint_targets
from calibration.study.factors import read_factors
from calibration.study.new.grains import mean_diameter, sieve_curve
from calibration.study.new.laboratory import factors_of, materials
from calibration.study.new.methods.heaps import Heap
from calibration.study.new.study import one_run, study_name
from calibration.telling.sentences import opening
from dem.errors import MeasureError, RefusedStateError, StoppedError
from dem.spec import parse_spec
from facts import tells

RIG = "--density 1.35g/cm3 --grain 4mm --orifice 25mm --plate 10cm --height 75mm --no-pilot".split()
PILOTED = RIG[:-1]  # without --no-pilot
ANGLES = ["--measured", "26.1", "28.4", "27.0°"]


def test_a_study_begins_from_values_with_units(here, capsys):
    assert main(["new", "Weizen Prüfung 1", *ANGLES, *RIG]) == 0
    said = capsys.readouterr().out
    assert tells(said, "3 values", "26.1°", "28.4°", "27.17°", "1.2°")
    config = read("Weizen Prüfung 1")
    assert config.name == "Weizen_Prufung_1"
    assert config.own_run["materials"]["particle"]["density_kg_m3"] == 1350
    assert config.own_run["geometry"]["plate_diameter_mm"] == 100
    # laws that hold in motion
    assert config.own_run["laws"] == {"rolling": "elastic_plastic", "torsion": "marshall"}
    assert len((here / "Weizen Prüfung 1" / "config.yaml").read_text("utf-8").splitlines()) < 60
    factors = read_factors(config.factors)
    wide = [(0.2, 0.8), (0.2, 0.8), (0.02, 0.4)]  # restitution, friction, rolling: wall, grains
    assert [(f.low, f.high) for f in factors] == [*wide, *wide, (0.2, 0.4)]
    assert main(["new", "Weizen Prüfung 1", *ANGLES, *RIG]) == 2
    assert "exists already" in capsys.readouterr().err


def test_a_mean_is_told_with_its_spread_in_either_form(here):
    assert main(["new", "a", "--measured", "31.2", "--sd", "0.8", "--n", "6", *RIG]) == 0
    assert main(["new", "b", "--measured", "31.2", "sd=0.8", "n=6", *RIG]) == 0
    texts = [Path(name, "measured.csv").read_text("utf-8") for name in "ab"]
    assert texts[0] == texts[1]
    assert "31.2,deg,0.8,6" in texts[0]


def test_published_ranges_name_their_source(here):
    assert main(["new", "beans", *ANGLES, *RIG, "--material", "soybean"]) == 0
    by_key = {f.key: f for f in read_factors("beans/factors.tsv")}
    friction = by_key["contacts.particle_particle.static_friction"]
    assert (friction.low, friction.high) == pytest.approx((0.315, 0.585))  # 0.45 +- 30 %
    assert "Boac" in friction.description
    for name in materials():
        assert all(f.low < f.high and f.description for f in factors_of(name))


def test_grains_and_feed_agree_with_closed_forms():
    heap = Heap(2.0, 1210.0, 20.0, 80.0, 75.0, 45.0, 3e6)
    cone = math.pi / 3 * 40**3  # tan 45 degrees is 1
    assert heap.count * math.pi / 6 * 2**3 == pytest.approx(1.3 * 0.6 * cone, rel=1e-3)
    # by hand: rho_b = 726, clear opening 17.2 mm, grain of 5.07 mg
    rate = 0.58 * 726 * math.sqrt(9.81) * 0.0172**2.5 / 5.068e-6
    assert heap.capacity_per_s == pytest.approx(rate, rel=2e-3)
    # 65 % of what the orifice passes of grains of four times the volume (the quick profile's):
    # from 70 % on some heaps pack and some do not
    narrower = ((20 - 1.4 * 2 * 4 ** (1 / 3)) / 17.2) ** 2.5
    assert heap.feed_per_s == pytest.approx(0.65 * narrower * rate, rel=2e-3)
    coarser = heap.of_at_most(2000)
    volume = lambda h: h.count * h.diameter_mm**3  # noqa: E731
    assert coarser.count == pytest.approx(2000, rel=0.01)
    assert volume(coarser) == pytest.approx(volume(heap), rel=1e-2)
    assert heap.of_at_most(100).diameter_mm == pytest.approx(
        20 / 5
    )  # the orifice stays wide enough


def test_one_heap_is_calibrated_by_the_chain_and_a_density_beside_it_by_all(here, capsys):
    assert main(["new", "peas", *ANGLES, *RIG]) == 0
    assert read("peas").supplements == ["posterior"]
    assert main(["new", "beans", *ANGLES, *RIG, "--bulk-density", "0.76g/cm3", "790 kg/m3"]) == 0
    assert tells(capsys.readouterr().out, "2 values", "760 kg/m³", "790 kg/m³")
    both = read("beans")
    assert both.supplements == ["joint"]
    metrics = [t.metric for t in joint_targets(both)]
    assert metrics == ["angle_of_repose_deg", "poured_density_kg_m3"]
    packed = read_measured(both.measurements).of("bulk_density", "poured_density")
    assert packed[0].readings == (760.0, 790.0)


def test_a_rim_holds_a_bed_and_carries_the_heap(here, capsys):
    assert main(["new", "peas", *ANGLES, *RIG, "--rim", "4mm"]) == 0
    run = read("peas").own_run
    assert run["geometry"]["plate_rim_height_mm"] == 4
    bare, rimmed = (Heap(4.0, 1350, 25, 100, 75, 30, 3e6, plate_rim_height_mm=h) for h in (0, 4))
    bed = 1.3 * 0.6 * np.pi / 4 * 100**2 * 4 / (np.pi / 6 * 4**3)
    assert rimmed.count - bare.count == pytest.approx(bed, abs=1)
    assert rimmed.apex_mm == pytest.approx(4 + 50 * np.tan(np.pi / 6))


def test_an_orifice_that_steeper_heaps_would_touch_is_warned_of(here, capsys):
    low = ["30mm" if x == "75mm" else x for x in RIG]
    assert main(["new", "peas", *ANGLES, *low]) == 0  # the measured heap is 25.7 mm high
    # half of 100 mm times tan 32.17 degrees is 31.4 mm
    assert tells(capsys.readouterr().out, "orifice", "32 mm")
    assert main(["new", "beans", *ANGLES, *RIG]) == 0
    assert "touch the orifice" not in capsys.readouterr().out


def test_no_more_grains_are_simulated_than_asked(here, capsys):
    assert main(["new", "peas", *ANGLES, *RIG, "--grains", "800"]) == 0
    said = capsys.readouterr().out
    particles = read("peas").own_run["particles"]
    assert particles["count"] == pytest.approx(800, rel=1e-2)
    assert f"{particles['diameter_mm'] / 4:.2f} times" in said
    assert "--grains" not in said  # this rig takes no 4,000
    fine = ["2mm" if x == "4mm" else x for x in RIG]
    assert main(["new", "lentils", *ANGLES, *fine, "--grains", "2400"]) == 0
    said = capsys.readouterr().out
    assert tells(said, "quick profile", "600 grains")
    assert "--grains 4000 gives it 1000" in said


def test_designs_of_heaps_that_take_little_time_are_run_several_times(here, capsys):
    for grain, often in (("4mm", 4), ("1.8mm", 1)):
        assert main(["new", grain, *ANGLES, *(grain if x == "4mm" else x for x in RIG)]) == 0
        assert read(grain).screening.replicates == often
        assert read(grain).ascent.replicates == often
        assert read(grain).response_surface.replicates == max(often // 2, 1)


def test_a_sieve_curve_keeps_mass(tmp_path):
    path = tmp_path / "sieve.csv"
    path.write_text("diameter_mm;mass_percent\n1,0;25\n2,0;75\n")
    sizes = sieve_curve(path)
    assert sizes == {"by": "mass", "diameters_mm": [1.0, 2.0], "fractions": [0.25, 0.75]}
    # a gram of each class: 0.25/1 + 0.75/8 grains of unit volume
    assert mean_diameter(sizes) == pytest.approx((1 / (0.25 + 0.75 / 8)) ** (1 / 3))


def test_what_passes_each_sieve_makes_classes_between_them(tmp_path):
    path = tmp_path / "sieve.csv"
    path.write_text("diameter_mm,passing_percent\n4,100\n2,60\n1,0\n")  # coarsest first
    sizes = sieve_curve(path)
    assert sizes["fractions"] == [0.6, 0.4]
    assert sizes["diameters_mm"] == pytest.approx([math.sqrt(2), math.sqrt(8)], rel=1e-4)


@pytest.mark.parametrize("name", ["peas", "Weizen Prüfung 1", "x-1.2", "Éte", "小麦"])
def test_every_other_name_makes_a_study(name):
    assert study_name(name).replace("_", "").replace("-", "").isalnum()


def angles_of(name, capsys, *options):
    assert main(["new", name, "--measured", *options, *RIG]) == 0
    capsys.readouterr()
    return read_measured(f"{name}/measured.csv").of("heap", "angle_of_repose")[0]


def test_measured_angles_come_from_a_table_of_measurements(here, capsys):
    """As `dem angle` writes one, and a mean with its spread."""
    path, header = here / "a.csv", "experiment,quantity,value,unit,sd,n\n"
    rows = "heap,angle_of_repose,26.1,deg,,\nheap,height,21,mm,,\nheap,angle_of_repose,28.4,deg,,\n"
    path.write_text(header + rows)
    assert angles_of("peas", capsys, "a.csv").readings == (26.1, 28.4)
    path.write_text(header + "heap,angle_of_repose,27,deg,1,5\n")
    mean = angles_of("beans", capsys, "a.csv")
    assert (mean.value, mean.sd, mean.n) == (27, 1, 5)
    told = angles_of("lentils", capsys, "27", "sd=1", "n=5")
    assert (told.value, told.sd, told.n) == (27, 1, 5)


def test_a_rate_of_pouring_is_kept(here, capsys):
    assert main(["new", "peas", *ANGLES, *RIG, "--rate", "0.6kg/min"]) == 0
    # 10 g/s of grains of 1.35 g/cm3 and 4 mm, of 45.2 mg each
    fed = read("peas").own_run["geometry"]["generation_rate_per_s"]
    assert fed == round(10.0 / (1.35 * np.pi / 6 * 0.4**3))


@pytest.mark.parametrize(("resolution", "fewer"), [("quick", 4), ("test", 8)])
def test_a_resolution_keeps_the_volume(here, resolution, fewer):
    main(["new", "peas", *ANGLES, *RIG])
    full, less = read("peas"), read("peas", resolution=resolution)
    assert less.name == f"peas-{resolution}"
    spec, fine = (parse_spec({"experiment": "heap"} | c.own_run) for c in (less, full))
    assert spec.particles.count == pytest.approx(fine.particles.count / fewer, abs=1)
    assert (spec.particles.diameter_mm / 4.0) ** 3 == pytest.approx(fewer, rel=1e-4)
    # a stage gets the settings that the parser has made: they are not coarsened again
    assert type(less).model_validate(less.model_dump(mode="json")) == less


def test_a_range_that_holds_hardly_a_level_is_warned_of(here):
    main(["new", "peas", *ANGLES, *RIG])
    config = read("peas")
    assert not any("range" in s for s in opening(config))
    table = here / "peas" / "factors.tsv"
    text = table.read_text()
    line = next(x for x in text.splitlines() if "particle_particle.static_friction" in x)
    table.write_text(text.replace(line, line.replace("0.2\t0.8", "0.30\t0.305")))
    (said,) = (s for s in opening(config) if "range" in s)
    assert tells(said, "warning", "grain_grain_static_friction", "0.3", "0.305", "1.6%")


ANGLE = "angle_of_repose_deg"


def test_a_new_study_runs_without_a_warning_of_the_engine_in_all_profiles(here):
    wide = ["40mm" if x == "25mm" else x for x in RIG]
    main(["new", "peas", *ANGLES, *wide])
    for resolution in ("full", "quick"):
        said = opening(read("peas", resolution=resolution))
        assert not [s for s in said if s.startswith("warning")]


def test_a_heap_that_trembles_gets_time_and_then_shorter_steps(here, monkeypatch, capsys):

    def calm(spec):
        n = spec.numerics
        rests = n.max_time_s > 20.0 and n.rayleigh_fraction < 0.2
        if not rests:
            raise RefusedStateError("restless", "they move; give numerics.max_time_s more")
        return {ANGLE: 27.0}

    seen = piloted(monkeypatch, calm)
    assert main(["new", "peas", *ANGLES, *PILOTED]) == 0
    assert len(seen) == 2 + 2  # the middle in three turns, and the smooth end
    numerics = read("peas").own_run["numerics"]
    half = pytest.approx(0.5 * seen[0].numerics.rayleigh_fraction, abs=1e-4)
    assert (numerics["max_time_s"], numerics["rayleigh_fraction"]) == (24.0, half)
    assert tells(capsys.readouterr().out, "heap", "rayleigh_fraction", "rest")
    assert tells((here / "peas/README.md").read_text(), "max_time_s", "24", "rest")


def test_a_heap_that_rolls_off_is_told_what_keeps_it(here, monkeypatch, capsys):
    def rolls(spec):
        raise MeasureError("no heap: 5 grains lie on the plate")

    piloted(monkeypatch, rolls)
    assert main(["new", "peas", *ANGLES, *PILOTED]) == 0
    said = capsys.readouterr().out
    assert tells(said, "heap", "no value", "5 grains", "--rim", "--height")
    assert tells(said.splitlines()[-1], "do not start", "heap")


def test_a_pilot_that_is_ended_ends(here, monkeypatch):
    """A heap that was cut off from outside is no heap that does not stand."""
    import dem.run

    main(["new", "peas", *ANGLES, *RIG])

    def stopped(*_):
        raise StoppedError("stopped")

    monkeypatch.setattr(dem.run, "run", stopped)
    config = read("peas")
    with pytest.raises(StoppedError):
        one_run(point_spec(config.own_run, "heap", {}, 1))
