"""Yield loci out of shear testers' tables, made of known stresses."""

from pathlib import Path

import pytest
import yaml

from calibration.chain.bench_tests.shear import measured_locus
from calibration.errors import CalibrationError
from calibration.intake.measurements import read_measured
from calibration.intake.shear_tester import STEADY, measure_shear, read_points
from calibration.interface.commands import main
from calibration.study.config import parse_config
from facts import refused, tells

TABLE = Path("data/instruments/yield_locus_made.csv")
SLOPE, INTERCEPT = 0.7, 0.3
LOADS = (2.0, 4.0, 6.0)


def peak(load):
    return SLOPE * load + INTERCEPT


def table(name="normal stress [kPa],shear stress [Pa]"):
    rows = [f"{load:g},{1e3 * peak(load):g}" for load in LOADS]
    return "\n".join([name, *rows, ""])


def test_the_marked_example_is_what_the_test_makes():
    assert TABLE.read_text() == table()


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


REFUSED = {
    "normal stress,shear stress\n2,1.7\n": ["line 2, column normal stress", "no unit"],
    "sigma [kPa],shear stress [kPa]\n2,1.7\n": ["line 1", "no columns of a yield locus", "sigma"],
    "normal stress [kPa],shear stress [mm]\n2,1.7\n": ["line 2", "mm is of another kind"],
    "normal stress [kPa],shear stress [kPa]\n2,\n": ["has no shear stress"],
    "normal stress [kPa],shear stress [kPa]\n2,x\n": ["line 2", "shear stress", "'x'"],
}


@pytest.mark.parametrize("text", list(REFUSED))
def test_what_is_no_yield_locus_is_refused_with_a_sentence(tmp_path, text):
    path = tmp_path / "rst.csv"
    path.write_text(text)
    with pytest.raises(CalibrationError) as told:
        read_points(path)
    for word in ("rst.csv", *REFUSED[text]):
        assert word in str(told.value)


def test_an_existing_table_is_left_alone(tmp_path):
    (tmp_path / "kept.csv").write_text("mine")
    with refused(CalibrationError, "kept.csv"):
        measure_shear([TABLE], out=tmp_path / "kept.csv")
