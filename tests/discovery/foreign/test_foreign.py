"""Laws of strangers: the diagnosis names slot and state of laws that no file of the project holds,
and no other.

The data sets are closed forms with noise (`closed_forms`). Default: one set of four laws, two nulls
and an outlier. Slow: all laws at ten standard errors and all nulls, with the rates that are asked
of them.
"""

import closed_forms
import numpy as np
import pytest
import rates

from calibration.runs.simulated import simulate
from diagnosis import contacts
from diagnosis.extend import gain, real_values
from diagnosis.laws.forms import forms_of
from diagnosis.laws.found import discover, formula_of
from diagnosis.laws.mixed import evaluate
from diagnosis.measurements import read_measurements

LAWS = {law.name: law for law in closed_forms.LAWS}


def found_in(drawn, tmp_path, replicates=99):
    """What the diagnosis finds in a `closed_forms.Set`, read from a file as a user's table is."""
    path = tmp_path / "measurements.csv"
    drawn.table.to_csv(path, index=False)
    return discover(read_measurements(path), replicates=replicates)


@pytest.mark.parametrize(
    "name",
    ["power of speed", "lubrication film", "reading off by a radius", "logarithm of the rate"],
)
def test_slot_and_state_of_a_strangers_law_are_found(name, tmp_path):
    drawn = closed_forms.draw(LAWS[name], 20.0, seed=1)
    found = found_in(drawn, tmp_path)
    assert found.verdict != "adequate"
    assert rates.right(found, LAWS[name]), found.law
    assert not found.causes  # without the catalogue nothing can be named


@pytest.mark.parametrize(
    ("name", "added", "formula"),
    [
        (
            "attraction as d^2, drops",
            lambda d, k: -20.0 * k / d,
            "work ~ d^2: {:+.3g} mm at a size",
        ),
        ("attraction as d^2, slides", lambda d, k: 0.55 * k / d, None),
        ("reading off by a radius", lambda d, k: k * d, "a share of the diameter: {:+.3g} mm at"),
    ],
)
def test_what_a_law_adds_is_told_at_each_state_in_the_readings_unit(name, added, formula, tmp_path):
    drawn = closed_forms.draw(LAWS[name], 40.0, seed=5, which=1)
    law = found_in(drawn, tmp_path, replicates=39).law
    for v in law["values"]:
        assert v["low"] <= added(v["state"], drawn.strength) <= v["high"]
    ends = [law["values"][k]["value"] for k in (0, -1)]
    true = [added(law["values"][k]["state"], drawn.strength) for k in (0, -1)]
    assert ends == pytest.approx(true, rel=0.15)
    if formula:
        start, end = formula.split("{:+.3g}")
        assert law["formula"].startswith(start)
        assert end in law["formula"]
        middle = np.sqrt(law["values"][0]["state"] * law["values"][-1]["state"])
        told = float(law["formula"][len(start) :].split()[0])
        assert told == pytest.approx(added(middle, drawn.strength), rel=0.15)


def test_a_form_is_told_with_its_coefficients(tmp_path):
    """A restitution 0.72 v^-k, told about the middle of the plan's speeds."""
    drawn = closed_forms.draw(LAWS["power of speed"], 40.0, seed=3, which=1)
    tried = found_in(drawn, tmp_path, replicates=1).trials["drop"]
    law = tried.laws["drop:restitution(speed)"]
    power = forms_of(law, tried.readings, tried.centre)["power"]
    fitted = evaluate(power, tried.readings, tried.nuisance, tried.readings.log[None], tried.centre)
    middle = np.sqrt(closed_forms.speed(40.0) * closed_forms.speed(600.0))
    text = formula_of(law, tried, power, fitted)
    start, end = text.split(f" (speed/{middle:.3g} m/s)^")
    name, coefficient = start.split(": restitution = ")
    assert name == "power"
    assert float(coefficient) == pytest.approx(0.72 * middle**-drawn.strength, rel=0.02)
    assert float(end) == pytest.approx(-drawn.strength, rel=0.02)


@pytest.mark.parametrize("kind", ["plain", "camera set up anew for each height"])
def test_data_without_a_law_are_adequate(kind, tmp_path):
    assert found_in(closed_forms.null(kind, seed=1), tmp_path).verdict == "adequate"


def test_one_mistyped_reading_is_pointed_out_by_its_line(tmp_path):
    drawn = closed_forms.null("one doubled reading", seed=1)
    row = drawn.table.index[drawn.table["note"] == "mistyped"][0]
    found = found_in(drawn, tmp_path)
    assert [o["line"] for o in found.outliers] == [row + 2]  # the header is line 1
    assert found.verdict == "adequate"


def test_an_error_between_settings_is_told_and_its_size_is_right(tmp_path):
    sds = []
    for seed in range(3):
        found = found_in(closed_forms.null("error between settings", seed), tmp_path, 19)
        sds += [s["sd"] for s in found.scatter] or [0.0]
    true = 2.0 * closed_forms.RELATIVE / closed_forms.REPLICATES**0.5
    assert 0.5 * true < np.median(sds) < 2.0 * true


@pytest.mark.slow
def test_a_strangers_law_runs_in_the_engine(tmp_path):
    """Restitution that falls linearly with speed, all settings as they are: at levels that were
    left out of choice and fit the engine misses less with the curve than with a constant."""
    drawn = closed_forms.draw(LAWS["linear in speed"], 20.0, seed=11)
    path = tmp_path / "measurements.csv"
    drawn.table.to_csv(path, index=False)
    measurements, (rig, catalogue) = read_measurements(path), rates.study()
    found = contacts.discovered(measurements, rig, catalogue)
    assert found.verdict == "discovered"
    rows, specs, engine = contacts.nested(measurements, found, rig, catalogue).plan()
    metrics = simulate(specs, tmp_path / "runs")
    value = real_values(rig.settings, catalogue, measurements, rows, metrics)
    won = gain(measurements, value["before"], value["after"])
    assert won["held_out_rmse_after"] < 0.5 * won["held_out_rmse_before"]
    assert won["held_out_rmse_difference_interval"][0] > 0.0
    assert engine["keys"]["laws"] == {"damping": "restitution_curve"}


@pytest.mark.long
@pytest.mark.slow
def test_rates_over_all_laws_of_strangers(tmp_path):
    hits, bands, nulls = [], [], []
    for law in closed_forms.LAWS:
        drawn = closed_forms.draw(law, 10.0, seed=7)
        found = found_in(drawn, tmp_path)
        hits.append(rates.right(found, law))
        held = rates.inside(found, drawn)
        bands += [] if held is None else [held]
    for kind in closed_forms.NULLS:
        nulls += [
            found_in(closed_forms.null(kind, s, s), tmp_path).verdict == "adequate" for s in (7, 8)
        ]
    assert np.mean(hits) >= 0.8
    assert np.mean(bands) >= 0.8  # 90 % are asked; one of a dozen more may fall out by chance
    assert np.sum(~np.array(nulls)) <= 2  # 95 % are asked, of eighteen
