"""Yield loci out of shear testers' tables, made of known stresses."""

from pathlib import Path

import pytest
import yaml

from calibration.intake.measurements import read_measured
from calibration.intake.shear_tester import STEADY, read_points
from calibration.interface.commands import main
from calibration.stages.shear import measured_locus
from calibration.study.config import parse_config
from facts import tells

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
