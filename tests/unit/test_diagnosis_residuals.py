"""Sentences about the residuals, parameters that moved, and the gain on left-out settings; what
nothing explains is shown as a curve with a band, and asked for."""

import re

import numpy as np
import pytest
from diagnosis_cases import bench, residual

from calibration.intake.measurements import Measurement
from diagnosis import figures, residuals
from diagnosis.bulk import Bulk
from diagnosis.extend import gain, run_scatter
from diagnosis.page.markdown import page
from diagnosis.residuals import patterns
from diagnosis.verdict import carried, findings, validate, with_patterns
from facts import tells


def test_a_setting_without_a_lever_has_no_place():
    rows = [
        residual("heap", {}, 35.0, 30.0),
        residual("drop", {"drop_height_mm": 100.0}, 20.0, 20.0),
    ]
    [said] = [p["sentence"] for p in patterns(rows)]
    assert said == "The measured angle of repose exceeds the model by 17 % at its one setting."


def drops(measured):
    heights = (50.0, 100.0, 200.0, 300.0)
    return [
        residual("drop", {"drop_height_mm": h}, m, 0.2 * h)
        for h, m in zip(heights, measured, strict=True)
    ]


def test_a_slope_along_a_lever_is_told_with_its_two_ends():
    [found] = patterns(drops([10.1, 19.5, 36.0, 49.2]))
    assert found["lever"] == "drop_height_mm"
    short, agrees = found["sentence"].split(" and ")
    assert tells(short, "rebound", "short", "18 %", "drop height", "300 mm")
    assert tells(agrees, "agrees", "drop height", "50 mm")


def test_what_agrees_at_both_ends_is_told_of_all_settings_or_not_at_all():
    assert patterns(drops([10.5, 19.8, 40.3, 59.6])) == []
    [found] = patterns(drops([10.5, 25.0, 45.0, 60.5]))
    assert found["lever"] is None
    assert tells(found["sentence"], "rebound", "exceeds", "4 settings")


CONDITIONS = [
    Measurement("drop", 20.0, 1.0, 4, {"drop_height_mm": 100.0}),
    Measurement("drop", 40.0, 2.0, 4, {"drop_height_mm": 200.0}),
    Measurement("tilt", 30.0, 0.5, 4, {"tilt_rate_deg_s": 5.0}),
]


def test_the_gain_of_a_better_model_has_its_interval_on_its_side():
    before = np.array([[23.0, 23.0], [46.0, 46.0], [30.5, 30.5]])
    after = np.array([[20.1, 20.1], [40.2, 40.2], [30.1, 30.1]])
    found = gain(CONDITIONS, before, after)
    assert found["held_out_rmse_before"] > 3 > 1 > found["held_out_rmse_after"]
    low, high = found["held_out_rmse_difference_interval"]
    assert 0 < low < high
    assert found["by_experiment"]["drop"]["unit"] == "mm"
    assert found["by_experiment"]["tilt"] == {
        "before": pytest.approx(0.5),
        "after": pytest.approx(0.1),
        "unit": "deg",
    }
    shown = [line.get_xdata() for line in figures.gain_figure(found).axes[0].lines[1:]]
    for key, at in zip(("miss_before", "miss_after"), shown, strict=True):
        assert sorted(at) == sorted(p[key] for p in found["points"])


def test_scatter_of_the_runs_counts_as_error():
    rng = np.random.default_rng(3)
    values = np.array([20.0, 40.0, 30.0])[:, None] * (1.0 + 0.05 * rng.standard_normal((3, 400)))
    found = run_scatter(CONDITIONS, values) * np.sqrt(400)
    assert found == pytest.approx([1.0, 2.0, 1.5], rel=0.1)


LOADS = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6)


def rows(miss, loads=LOADS, seed=1, error=0.01):
    """Residuals of shear tests whose stress is `miss` (a function of the load) of itself off."""
    rng = np.random.default_rng(seed)
    return [
        {
            "experiment": "shear",
            "levers": {"normal_stress_kPa": s},
            "measured": 0.6 * s * (1.0 + miss(s) + error * rng.standard_normal()),
            "predicted": 0.6 * s,
            "sd": 0.6 * s * error,
        }
        for s in loads
    ]


def bump(load):
    return 0.1 * np.exp(-(np.log(load / 2.0) ** 2) / 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("miss", [bump, lambda s: 0.05 * np.log(s), lambda s: 0.0 * s])
def test_the_band_holds_the_discrepancy(miss):
    inside = []
    for seed in range(20):
        [curve] = residuals.curves(rows(miss, seed=seed))
        true = miss(np.array(curve["at"]))
        inside += list((np.array(curve["low"]) <= true) & (true <= np.array(curve["high"])))
    assert curve["unit"] == "share"
    assert np.mean(inside) > 0.9


def test_what_is_least_known_is_asked_for():
    """Four loads close together and one far away: the gap between them, or the far end."""
    own = rows(bump, loads=(1.0, 1.1, 1.2, 1.3, 5.6))
    asked = residuals.least_known(own)
    assert 1.3 < asked["levers"]["normal_stress_kPa"] < 5.6
    beyond = residuals.least_known(own, {"shear": {"normal_stress_kPa": (1.0, 9.0)}})
    assert beyond["levers"]["normal_stress_kPa"] > 1.3
    assert beyond["information_bits"] >= asked["information_bits"]
    # a load that was read has at most a bit left, for its own error stays
    assert asked["information_bits"] > 1.0
    assert residuals.least_known(rows(bump, loads=(2.0, 2.0))) is None


@pytest.fixture(scope="module")
def emulated():
    mechanisms = {"shear": {"mechanisms": ["cohesion"]}}
    return bench(["shear"], {"experiments": mechanisms})


def shears(stress, n=5):
    return [
        Measurement("shear", stress(s), 0.02 * stress(s), n, {"normal_stress_kPa": s})
        for s in LOADS
    ]


def test_a_hump_that_no_mechanism_has_is_shown(emulated):
    measured = shears(lambda s: 0.6 * s * (1.0 + 0.4 * np.exp(-(np.log(s / 2.4) ** 2) / 0.6)))
    bulk = Bulk(emulated, measured)
    found = bulk.judged()
    assert found.verdict == "unexplained"
    verdict = with_patterns(findings(bulk, found, 0.05), emulated.settings)
    [curve] = verdict["discrepancy"]
    assert max(curve["low"]) > 0.0
    assert min(curve["high"]) < 0.0
    assert len(verdict["next_measurement"]["predictions"]) == 1
    validate(verdict)
    text = page(verdict)
    assert re.search(r"^## .*discrepancy", text, re.M)
    assert tells(text, "1 of the 2")


def test_a_yield_locus_carries_one_coefficient_and_its_intercept_another(emulated):
    """Two frictions act through one slope: their sum is known, and not each."""
    straight = Bulk(emulated, shears(lambda s: 0.6 * s))
    assert carried(*straight.fit(())) == 1
    assert carried(*straight.fit(["cohesion"])) == 2
