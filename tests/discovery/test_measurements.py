"""The table of measurements: good rows are read, each fault is one error with its line and column."""

import pytest

from calibration.discrepancy.measurements import read_measurements, to_table
from calibration.errors import ConfigError

HEADER = "experiment,quantity,value,unit,sd,n,drop_height_mm,tilt_rate_deg_s,output_interval_s,note"
GOOD = [
    "drop,rebound_height,20.5,mm,1,5,150,,,",
    "drop,rebound_height,40,mm,1,5,300,,0.01,two",
    "tilt,sliding_angle,35.8,deg,0.5,5,,5,,",
]


def write(tmp_path, rows, header=HEADER):
    path = tmp_path / "measurements.csv"
    path.write_text("\n".join(["# a comment", header, *rows]) + "\n")
    return path


def test_good_rows_come_back_with_their_levers(tmp_path):
    drop, second, tilt = read_measurements(write(tmp_path, GOOD))
    assert (drop.value, drop.sd, drop.n, drop.levers) == (20.5, 1.0, 5, {"drop_height_mm": 150.0})
    assert second.levers == {"drop_height_mm": 300.0, "output_interval_s": 0.01}
    assert tilt.experiment == "tilt"


def test_written_table_reads_back(tmp_path):
    measured = read_measurements(write(tmp_path, GOOD))
    path = tmp_path / "again.csv"
    to_table(measured).to_csv(path, index=False)
    assert read_measurements(path) == measured


FAULTS = [
    ("drip,rebound_height,20,mm,1,5,150,,,", "experiment", "heap, drop, tilt, shear"),
    ("drop,sliding_angle,20,mm,1,5,150,,,", "quantity", "rebound_height"),
    ("drop,rebound_height,20,cm,1,5,150,,,", "unit", "mm"),
    ("drop,rebound_height,twenty,mm,1,5,150,,,", "value", "not a number"),
    ("tilt,sliding_angle,95,deg,1,5,,5,,", "value", "0 to 90"),
    ("drop,rebound_height,20,mm,,5,150,,,", "sd", "missing"),
    ("drop,rebound_height,20,mm,0,5,150,,,", "sd", "out of range"),
    ("drop,rebound_height,20,mm,1,2.5,150,,,", "n", "whole number"),
    ("drop,rebound_height,20,mm,1,0,150,,,", "n", "out of range"),
    ("drop,rebound_height,20,mm,1,5,,,,", "drop_height_mm", "needed"),
    ("drop,rebound_height,20,mm,1,5,150,5,,", "tilt_rate_deg_s", "no lever of drop"),
    ("tilt,sliding_angle,35,deg,1,5,,1e6,,", "tilt_rate_deg_s", "out of range"),
    ("drop,rebound_height,21,mm,1,5,150,,,", "experiment", "line 3"),
    ("drop,rebound_height,nan,mm,1,5,250,,,", "value", "out of range"),
]


@pytest.mark.parametrize(("row", "column", "says"), FAULTS)
def test_each_fault_names_line_and_column(tmp_path, row, column, says):
    path = write(tmp_path, [*GOOD, row])
    with pytest.raises(ConfigError) as caught:
        read_measurements(path)
    assert f"{path}, line 6, column {column}:" in str(caught.value)
    assert says in str(caught.value)


def test_too_few_conditions(tmp_path):
    with pytest.raises(ConfigError, match="too few conditions"):
        read_measurements(write(tmp_path, GOOD[:2]))


def test_unknown_and_missing_columns(tmp_path):
    with pytest.raises(ConfigError, match=r"line 2, column colour: is no known column"):
        read_measurements(write(tmp_path, GOOD, HEADER.replace("note", "colour")))
    with pytest.raises(ConfigError, match=r"column sd: is missing"):
        read_measurements(
            write(tmp_path, GOOD, HEADER.replace("sd", "note").replace(",note", "", 1))
        )


def test_a_missing_file(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        read_measurements(tmp_path / "none.csv")
