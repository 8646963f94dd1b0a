"""Yield loci and the friction for a measured slope, from shear stresses made by a known law and out
of shear testers' tables."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration.chain.study import Study
from calibration.intake.measurements import read_measured
from calibration.intake.shear_tester import STEADY, read_points
from calibration.interface.commands import main
from calibration.runs.plans import read_plan
from calibration.stages.bench_tests import SlopeCurve, measured_locus, plan_shear, yield_locus
from calibration.study.config import parse_config
from facts import tells
from stage_files import PlanFiles

FRICTION, NORMAL = np.meshgrid([0.2, 0.4, 0.6, 0.85], np.repeat([0.5, 1.0, 2.0], 3))
FRICTION, NORMAL = FRICTION.ravel(), NORMAL.ravel()


def bulk_slope(mu):
    return 0.4 + 0.9 * mu - 0.5 * mu**2


def stress(noise):
    scatter = np.random.default_rng(4).normal(0.0, noise, len(NORMAL))
    return NORMAL * (bulk_slope(FRICTION) + scatter) + 0.08


def test_an_exact_law_gives_its_own_slopes_and_inverse():
    curve = SlopeCurve(FRICTION, NORMAL, stress(0.0))
    assert curve.at(0.5)[0] == pytest.approx(bulk_slope(0.5))
    friction, interval = curve.inverse(bulk_slope(0.55))
    assert friction == pytest.approx(0.55, abs=1e-4)
    assert interval == pytest.approx([0.55, 0.55], abs=2e-3)


def test_the_interval_of_the_inverse_covers_the_truth_and_widens_with_the_scatter():
    widths = []
    for noise in (0.02, 0.06):
        _, (low, high) = SlopeCurve(FRICTION, NORMAL, stress(noise)).inverse(bulk_slope(0.5))
        assert low < 0.5 < high
        widths.append(high - low)
    assert widths[1] > widths[0]


def test_a_slope_out_of_reach_has_no_inverse():
    curve = SlopeCurve(FRICTION, NORMAL, stress(0.02))
    assert curve.inverse(1.5) == (None, None)


def test_a_slope_just_above_the_curve_is_met_where_it_comes_nearest():
    curve = SlopeCurve(FRICTION, NORMAL, stress(0.05))
    top = max(curve.at(np.linspace(0.2, 0.85, 200))[0])
    friction, (low, high) = curve.inverse(top + 0.005)
    assert low <= friction <= high
    assert curve.at(friction)[0] == pytest.approx(top, abs=1e-3)


def test_yield_locus_of_a_line_with_apparent_cohesion():
    locus = yield_locus([0.5, 1.0, 2.0, 4.0], [0.50, 0.93, 1.77, 3.46])
    assert locus["slope"] == pytest.approx(0.845, abs=0.005)
    assert locus["slope_interval"][0] < locus["slope"] < locus["slope_interval"][1]
    assert locus["intercept_kPa"] == pytest.approx(0.08, abs=0.01)


def test_each_cell_of_the_plan_has_its_own_seeds_and_its_levels(tmp_path, repository):
    config = parse_config(yaml.safe_load(Path("config/config.yaml").read_text()))
    fixed = {"fixed": {"salt_steel_static_friction": 0.0}}
    ring = config.tests["ring"].model_copy(update=fixed)
    study, section = Study(config.model_copy(update={"tests": {"ring": ring}})), ring.sweep
    plan_shear(study, None, PlanFiles.of(tmp_path))
    specs = list(read_plan(tmp_path / "plan.json").values())
    cells = len(section.levels) * len(section.normal_stresses_kPa)
    assert len(specs) == len({s["seed"] for s in specs}) == cells * section.replicates
    friction = {s["contacts"]["particle_particle"]["static_friction"] for s in specs}
    assert friction == set(section.levels)
    assert {s["contacts"]["particle_wall"]["static_friction"] for s in specs} == {0.0}
    assert {s["contacts"]["particle_wall"]["restitution"] for s in specs} == {0.421}


SLOPE, INTERCEPT = 0.7, 0.3
LOADS = (2.0, 4.0, 6.0)


def peak(load):
    return SLOPE * load + INTERCEPT


def table(name="normal stress [kPa],shear stress [Pa]"):
    rows = [f"{load:g},{1e3 * peak(load):g}" for load in LOADS]
    return "\n".join([name, *rows, ""])


@pytest.mark.parametrize(
    "name",
    ["normal stress [kPa],shear stress [Pa]", "normal_stress_kPa,shear_stress_Pa",
     "Normal Stress (kPa),Shear stress (Pa)"],
)  # fmt: skip
def test_a_plain_table_is_a_yield_locus_of_the_study(tmp_path, name, monkeypatch, capsys):
    (tmp_path / "rst.csv").write_text(table(name))
    assert main(["shear", str(tmp_path / "rst.csv"), "--out", str(tmp_path / "shear.csv")]) == 0
    said = capsys.readouterr().out
    assert tells(said, "rst.csv", "3 peaks", "2 to 6 kPa", "0.700", "0.3 kPa")
    read = read_measured(tmp_path / "shear.csv").of("shear", "shear_stress")
    assert [m.levers["normal_stress_kPa"] for m in read] == list(LOADS)
    config = yaml.safe_load(Path("config/config.yaml").read_text())
    rows = (tmp_path / "shear.csv").read_text().splitlines()
    measured = "\n".join([rows[0], *["heap,angle_of_repose,30,deg,,"] * 2, *rows[1:]])
    (tmp_path / "measured.csv").write_text(measured)
    config["measurements"] = str(tmp_path / "measured.csv")
    config["supplements"] = ["shear"]
    slope, intercept = measured_locus(parse_config(config))
    assert (slope, intercept) == (pytest.approx(SLOPE), pytest.approx(INTERCEPT))


def test_steady_stresses_alone_are_taken_too(tmp_path):
    path = tmp_path / "rst.csv"
    path.write_text("Normal stress [Pa];Steady shear stress [Pa]\n1000;650,5\n2000;1250,5\n")
    assert [(p.quantity, p.load, p.shear) for p in read_points(path)] == [
        (STEADY, 1.0, 0.6505), (STEADY, 2.0, 1.2505)]  # fmt: skip
