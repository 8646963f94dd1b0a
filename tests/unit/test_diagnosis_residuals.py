"""The discrepancy along a lever with its band, the gain on left-out settings, and how many
coefficients the data carry."""

import numpy as np
import pytest
from diagnosis_cases import bench

from calibration.intake.measurements import Measurement
from diagnosis import figures, residuals
from diagnosis.bulk import Bulk
from diagnosis.extend import gain, run_scatter
from diagnosis.laws.readings import readings_of
from diagnosis.page.markdown import page
from diagnosis.table_model.selection import blocks_of
from diagnosis.verdict import carried, extension, findings, validate
from facts import tells

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


def blocks(miss, seed=1, error=0.01):
    """Blocks of shear tests whose stress is `miss` (a function of the load) of itself off."""
    rng = np.random.default_rng(seed)
    rows = []
    for load in LOADS:
        stress = 0.6 * load * (1.0 + miss(load) + error * rng.standard_normal())
        own = error * np.sqrt(5.0) * stress
        rows.append(Measurement("shear", stress, own, 5, {"normal_stress_kPa": load}))
    return blocks_of([readings_of(rows, "shear")], None)


def bump(load):
    return 0.1 * np.exp(-(np.log(load / 2.0) ** 2) / 0.2)


@pytest.mark.parametrize("miss", [bump, lambda s: 0.05 * np.log(s), lambda s: 0.0 * s])
def test_the_band_holds_the_discrepancy(miss):
    """Beside the level, which a friction takes up."""
    inside = []
    for seed in range(20):
        [curve] = residuals.curves(blocks(miss, seed=seed))
        assert curve["at"] == pytest.approx(LOADS)
        true = np.log1p(miss(np.array(LOADS)))
        true = np.expm1(true - true.mean())
        inside += list((np.array(curve["low"]) <= true) & (true <= np.array(curve["high"])))
    assert np.mean(inside) > 0.9


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
    verdict = findings(bulk, found, extension(bulk, found), 0.05)
    [curve] = verdict["discrepancy"]
    assert max(curve["low"]) > 0.0
    assert min(curve["high"]) < 0.0
    validate(verdict)
    text = page(verdict)
    assert tells(text, "shear stress differs from the model", "normal stress of 2.8 kPa")
    assert tells(text, "further levels of the normal stress", "between 1 and 2.8 kPa")
    assert tells(text, "1 of the 2")


def test_a_yield_locus_carries_one_coefficient_and_its_intercept_another(emulated):
    """Two frictions act through one slope: their sum is known, and not each."""
    straight = Bulk(emulated, shears(lambda s: 0.6 * s))
    assert carried(*straight.fit(())) == 1
    assert carried(*straight.fit(["cohesion"])) == 2
