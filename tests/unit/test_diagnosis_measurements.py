"""The table of measurements: good rows are read, each fault is one error with its line and
column."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from calibration.errors import ConfigError
from calibration.intake.measurements import read_measured
from diagnosis.fit import data_of
from diagnosis.measurements import read_all
from diagnosis.verdict import remarks
from facts import refused, tells

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


def test_values_in_other_units_are_converted(tmp_path):
    rows = [
        "drop,rebound_height,2.05,cm,0.1,5,15 cm,,,",
        "tilt,sliding_angle,0.625 rad,deg,0.5,5,,5,,",
        GOOD[1],
    ]
    drop, tilt, _ = read_all(write(tmp_path, rows)).fitted
    assert (drop.value, drop.sd) == pytest.approx((20.5, 1.0))
    assert drop.levers == {"drop_height_mm": 150.0}
    assert tilt.value == pytest.approx(0.625 * 180 / 3.141592653589793)


FAULTS = [
    ("drop,sliding_angle,20,mm,1,5,150,,,", "quantity", "rebound_height"),
    ("drop,rebound_height,151,mm,1,5,150.5,,,", "value", "less than drop_height_mm = 150.5"),
    ("drop,rebound_height,20,mm,,5,150,,,", "sd", "missing"),
    ("drop,rebound_height,20,mm,1,,150,,,", "n", "missing"),
    ("drop,rebound_height,20,mm,1,5,,,,", "drop_height_mm", "needed"),
    ("drop,rebound_height,20,mm,1,5,150,5,,", "tilt_rate_deg_s", "no lever of drop"),
    ("tilt,sliding_angle,35,deg,1,5,,1e6,,", "tilt_rate_deg_s", "out of range"),
    ("drop,rebound_height,21,mm,1,5,150.0,,,", "experiment", "line 3"),
]


def test_a_condition_may_stand_once_in_each_batch(tmp_path):
    header = HEADER.replace("note", "batch,instrument")
    rows = [GOOD[0].removesuffix(",") + f",{batch}," for batch in ("monday", "tuesday")]
    rows.append(GOOD[1].replace("two", "monday") + ",video")
    first, second, third = read_all(write(tmp_path, rows, header)).fitted
    assert (first.batch, second.batch) == ("monday", "tuesday")
    assert third.instrument == "video"
    with refused(ConfigError, "3", path="measurements.csv", line=6, column="experiment"):
        read_all(write(tmp_path, [*rows, rows[0]], header))


FULL = "experiment,quantity,value,unit,sd,n,drop_height_mm,replicate,role,lever_sd,outcome,batch"


def drops(*cells):
    """Rows of drops: value, sd, n, height, replicate, role, lever_sd, outcome, batch."""
    return [",".join(["drop", "rebound_height", c[0], "mm", *c[1:]]) for c in cells]


MEANS = drops(*[(str(h / 7), "1", "5", str(h), "", "", "", "", "") for h in (100, 200, 300)])


def test_replicates_as_rows_are_one_condition(tmp_path):
    rows = drops(
        ("20", "", "", "150", "a", "", "", "", ""),
        ("22", "", "", "150", "b", "", "", "", ""),
        ("24", "", "", "150", "c", "", "", "", ""),
        ("30", "", "", "150", "a", "", "", "", "two"),
        ("31", "", "", "150", "b", "", "", "", "two"),
    )
    *_, one, two = read_all(write(tmp_path, MEANS + rows, FULL)).fitted
    assert (one.value, one.sd, one.n, one.line) == (22.0, 2.0, 3, 6)
    assert (two.value, two.n, two.batch, two.line) == (30.5, 2, "two", 9)


def test_a_reading_that_is_alone_takes_the_spread_of_the_others(tmp_path):
    """Means of five with a spread of 10 % tell that of the one reading beside them."""
    means = drops(*[(str(h / 5), str(h / 50), "5", str(h)) + ("",) * 5 for h in (100, 200, 300)])
    lone = drops(("30", "", "", "150", "a", "", "", "", ""))
    found = read_all(write(tmp_path, means + lone, FULL))
    one = found.fitted[-1]
    assert (one.n, one.line) == (1, 6)
    assert one.sd == pytest.approx(3.0 * student.ppf(0.975, 12) / 1.96, rel=1e-4)
    assert tells(remarks(found)[0], "Line 6")


def test_a_reading_a_day_of_each_setting_tells_the_spread(tmp_path):
    """An additive table of settings and days, with one interaction c of known sum of squares: the
    analysis of variance of two ways without replicates (Fisher 1935)."""
    header = "experiment,quantity,value,unit,tilt_rate_deg_s,batch"
    rows = [
        f"tilt,sliding_angle,{30 + rate + 2 * day + sign * 0.4},deg,{rate},day {day}"
        for rate, signs in ((2, (1, -1)), (5, (-1, 1)), (9, (0, 0)))
        for day, sign in enumerate(signs)
    ]
    found = read_all(write(tmp_path, rows, header)).fitted
    assert [m.n for m in found] == [1] * 6
    spread = np.sqrt(4 * 0.4**2 / 2)  # four readings are off by 0.4, two degrees of freedom
    wide = student.ppf(0.975, 2) / 1.96
    assert [m.sd for m in found] == pytest.approx([spread * wide] * 6, rel=1e-4)
    with refused(ConfigError, "line 3", "column sd", "batches"):
        read_all(write(tmp_path, [r for r in rows if "day 0" in r], header))


def test_held_out_rows_and_tests_without_a_value_are_apart(tmp_path):
    rows = drops(
        ("20", "1", "5", "150", "", "hold out", "", "", ""),
        ("", "", "3", "160", "", "", "", "clogged", ""),
    )
    found = read_all(write(tmp_path, MEANS + rows, FULL))
    assert [m.line for m in found.fitted] == [3, 4, 5]
    assert [m.line for m in found.held_out] == [6]
    [lost] = found.outcomes
    assert (lost.line, lost.outcome, lost.n) == (7, "clogged", 3)


def test_an_uncertain_height_widens_the_error_of_its_rebound(tmp_path):
    rows = drops(("20", "1", "4", "150", "", "", "3", "", ""))
    found = read_all(write(tmp_path, MEANS + rows, FULL)).fitted
    [plain] = data_of([replace(found[-1], lever_sd=0.0)]).error[0]
    [error] = data_of(found[-1:]).error[0]
    # a height known to 2 % makes a rebound of 20 mm uncertain by 0.4 mm
    assert error == pytest.approx(np.hypot(plain, 0.4))


FURTHER_FAULTS = [
    (("20", "1", "", "150", "a", "", "", "", ""), "sd", "no meaning beside replicate"),
    (("20", "1", "5", "150", "", "spare", "", "", ""), "role", "calibrate, hold out"),
    (("20", "1", "5", "150", "", "", "", "lost", ""), "outcome", "clogged, arched"),
    (("20", "", "", "150", "", "", "", "clogged", ""), "value", "no meaning beside outcome"),
    (("", "1", "5", "150", "", "", "", "", ""), "value", "or what the test ended with"),
    (("20", "1", "5", "150", "", "", "-1", "", ""), "lever_sd", "out of range"),
]


@pytest.mark.parametrize(
    ("header", "rows", "column", "says"),
    [
        *((HEADER, [*GOOD, row], *named) for row, *named in FAULTS),
        *((FULL, MEANS + drops(cells), *named) for cells, *named in FURTHER_FAULTS),
    ],
)
def test_each_fault_names_line_and_column(tmp_path, header, rows, column, says):
    path = write(tmp_path, rows, header)
    with pytest.raises(ConfigError) as caught:
        read_all(path)
    assert f"{path}, line 6, column {column}:" in str(caught.value)
    assert says in str(caught.value)


def test_further_numbers_are_covariates_and_a_near_name_is_refused(tmp_path):
    """Humidity is recorded beside; a condition may stand once for each value of it."""
    rows = ["drop,rebound_height,20,mm,1,5,150,%s", "drop,rebound_height,21,mm,1,5,150,%s"]
    header = "experiment,quantity,value,unit,sd,n,drop_height_mm,%s"

    def table(name, first, second):
        path = tmp_path / "further.csv"
        path.write_text("\n".join([header % name, rows[0] % first, rows[1] % second]) + "\n")
        return read_measured(path).conditions

    found = table("humidity_percent", "40", "70")
    assert [m.covariates for m in found] == [{"humidity_percent": 40.0}, {"humidity_percent": 70.0}]
    with refused(
        ConfigError, path="further.csv", line=1, column="batsh", allowed="batch, it seems"
    ):
        table("batsh", "1", "2")
    with refused(ConfigError, path="further.csv", line=1, column="day_of_week"):
        table("day_of_week", "monday", "2")


def test_readings_of_a_setting_are_parted_by_what_was_recorded_beside_them(tmp_path):
    """A diagnosis takes readings at two temperatures for two conditions, where of each there are
    two; each reading with a number of its own is one where it goes with that number, and the page
    says so."""

    def table(*degrees, slope=0.05):
        path = tmp_path / "degrees.csv"
        head = "experiment,quantity,value,unit,drop_height_mm,temperature_C"
        rows = [f"drop,rebound_height,{h / 5 + slope * t},mm,{h},{t}" for h in (50, 90, 150)
                for t in degrees]  # fmt: skip
        path.write_text("\n".join([head, *rows]) + "\n")
        return path

    parted = table(0, 0, 30, 30)
    found = read_all(parted)
    assert [(m.n, m.covariates["temperature_C"]) for m in found.fitted] == [(2, 0), (2, 30)] * 3
    assert remarks(found) == []
    assert [m.n for m in read_measured(parted).conditions] == [4, 4, 4]  # one test at a setting
    alone = read_all(table(0, 10, 20, 30))
    assert [(m.n, m.covariates["temperature_C"]) for m in alone.fitted][:2] == [(1, 0), (1, 10)]
    assert alone.singly["drop"]["of"] in ("temperature_C", "order")
    pooled = read_all(table(0, 10, 20, 30, slope=0.0))
    assert [(m.n, m.covariates["temperature_C"]) for m in pooled.fitted] == [(4, 15)] * 3
    assert tells(remarks(pooled)[0], "temperature_C")


def test_readings_that_are_all_alike_have_a_spread_of_nothing(tmp_path):
    path = tmp_path / "alike.csv"
    path.write_text(
        "experiment,quantity,value,unit,sd,n,drop_height_mm\ndrop,rebound_height,20,mm,0,5,150\n"
    )
    assert 0.0 < read_measured(path).conditions[0].sd < 1e-6


def test_readings_rounded_to_one_value_are_known_to_what_rounding_takes_off(tmp_path):
    """A uniform error over one step has the standard deviation step / sqrt(12)."""
    read = {2: (31, 31, 31), 5: (33, 33, 33), 9: (34, 36, 38)}
    rows = [f"tilt,sliding_angle,{v},deg,{r}" for r, own in read.items() for v in own]
    found = read_all(write(tmp_path, rows, "experiment,quantity,value,unit,tilt_rate_deg_s")).fitted
    assert [m.sd for m in found] == pytest.approx([1 / np.sqrt(12), 1 / np.sqrt(12), 2.0])


def test_a_slip_of_the_decimal_point_is_set_aside_and_named_by_its_line(tmp_path):
    read = [(d, v) for d in (3, 4, 5) for v in (30.1, 30.9, 29.8, 30.4, 3.06 if d == 4 else 30.6)]
    rows = [f"heap,angle_of_repose,{value},deg,{d}" for d, value in read]
    header = "experiment,quantity,value,unit,particle_diameter_mm"
    found = read_all(write(tmp_path, rows, header))
    assert [m.n for m in found.fitted] == [5, 4, 5]
    assert [row["line"] for row in found.aside] == [12]
    assert found.fitted[1].value == pytest.approx(30.3)


def test_readings_whose_scatter_grows_stay(tmp_path):
    """Of tables of normal readings whose scatter grows ninefold over the sizes, one of a thousand
    loses a reading; where one of a hundred did, more than two of forty would be rare (p < 0.01)."""
    rng, sizes = np.random.default_rng(11), np.geomspace(2.0, 8.0, 6)
    header, lost = "experiment,quantity,value,unit,particle_diameter_mm", 0
    for _ in range(40):
        read = {d: 30.0 + 0.3 * 9.0**k * rng.standard_normal(5)
                for d, k in zip(sizes, np.linspace(0.0, 1.0, 6), strict=True)}  # fmt: skip
        rows = [f"heap,angle_of_repose,{v},deg,{d}" for d, values in read.items() for v in values]
        lost += bool(read_all(write(tmp_path, rows, header)).aside)
    assert lost <= 2
