"""Yield loci out of shear testers' tables, made of known stresses in the layouts that are read."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from calibration.chain.bench_tests.shear import measured_locus
from calibration.errors import CalibrationError
from calibration.intake.measurements import read_measured
from calibration.intake.shear_tester import PEAK, STEADY, measure_shear, read_points
from calibration.interface.commands import main
from calibration.study.config import parse_config
from facts import refused, tells

EXPORT = Path("data/instruments/rheocompass_made.csv")
TABLE = Path("data/instruments/yield_locus_made.csv")
SLOPE, INTERCEPT, SHARE = 0.7, 0.3, 0.8
LOADS = (2.0, 4.0, 6.0)
PRESHEAR = 9.0
POINTS = [2, 4, 6]
"""Intervals of the export that are points: a pre-shear stands before each."""


def peak(load):
    return SLOPE * load + INTERCEPT


def interval(number, load, readings, mark, separator):
    """An interval that climbs to its peak half way and falls to SHARE of it, in Pa and kPa."""
    shape = np.interp(
        range(readings), [0, readings // 2, readings - 6, readings], [0, 1, *[SHARE] * 2]
    )
    names = ["Interval data:", "Point No.", "Time", "Normal Stress", "Shear Stress"]
    rows = [["Interval and data points:", str(number), str(readings)], names, [""] * 5,
            ["", "", "[s]", "[kPa]", "[Pa]"]]  # fmt: skip
    for k, share in enumerate(shape):
        cells = ["", str(k + 1), f"{0.5 * k:.1f}", f"{load:.3f}", f"{1e3 * share * peak(load):.6E}"]
        rows.append([c.replace(".", mark) for c in cells])
    return [separator.join(r) for r in rows] + [""]


def export(separator="\t", mark="."):
    """What RheoCompass exports of a made shear test: pre-shear and shear in turn."""
    lines = [f"Project:{separator}made, by a test", f"Test:{separator}Yield locus", ""]
    lines += [f"Result:{separator}Powder 1", ""]
    for k, load in enumerate(LOADS):
        lines += interval(2 * k + 1, PRESHEAR, 20, mark, separator)
        lines += interval(2 * k + 2, load, 20, mark, separator)
    return "\r\n".join(lines)


def table(name="normal stress [kPa],shear stress [Pa]"):
    rows = [f"{load:g},{1e3 * peak(load):g}" for load in LOADS]
    return "\n".join([name, *rows, ""])


@pytest.mark.parametrize(
    ("separator", "mark", "encoding"),
    [("\t", ".", "utf-16"), ("\t", ",", "utf-16"), (";", ",", "cp1252"), ("\t", ".", "utf-8")],
)
def test_the_stresses_of_an_export_come_back(tmp_path, separator, mark, encoding):
    path = tmp_path / "export.csv"
    path.write_bytes(export(separator, mark).encode(encoding))
    found = read_points(path, POINTS)
    peaks = [(p.load, p.shear) for p in found if p.quantity == PEAK]
    steady = [(p.load, p.shear) for p in found if p.quantity == STEADY]
    assert peaks == [(load, pytest.approx(peak(load))) for load in LOADS]
    assert steady == [(load, pytest.approx(SHARE * peak(load))) for load in LOADS]


def test_the_marked_examples_are_what_the_tests_make():
    assert EXPORT.read_bytes().decode("utf-16") == export()
    assert TABLE.read_text() == table()


def test_an_export_tells_its_intervals_until_the_points_are_chosen(tmp_path):
    with pytest.raises(CalibrationError) as told:
        measure_shear([EXPORT])
    assert tells(str(told.value), "6 intervals", "1 Powder 1", "6.6 kPa", "9 kPa")
    assert "--intervals" in str(told.value)
    with refused(CalibrationError, "interval 7", path="rheocompass_made.csv"):
        measure_shear([EXPORT], [2, 7])


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
    export().replace("Normal Stress", "Normal Force"): ["line 7", "no column Normal Stress"],
    export().replace("[Pa]", "[mm]"): ["line 10", "Shear Stress", "another kind"],
}


@pytest.mark.parametrize("text", list(REFUSED))
def test_what_is_no_yield_locus_is_refused_with_a_sentence(tmp_path, text):
    path = tmp_path / "rst.csv"
    path.write_text(text)
    with pytest.raises(CalibrationError) as told:
        read_points(path, POINTS if "Interval" in text else ())
    for word in ("rst.csv", *REFUSED[text]):
        assert word in str(told.value)


def test_an_existing_table_is_left_alone(tmp_path):
    (tmp_path / "kept.csv").write_text("mine")
    with refused(CalibrationError, "kept.csv"):
        measure_shear([TABLE], out=tmp_path / "kept.csv")
