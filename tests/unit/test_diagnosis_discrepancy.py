"""What nothing explains is shown as a curve with a band, and asked for where it is least known."""

import re

import numpy as np
import pytest
from diagnosis_cases import bench

from calibration.intake.measurements import Measurement
from diagnosis import discrepancy
from diagnosis.identify import carried, identify
from diagnosis.page.markdown import page
from diagnosis.settings import BASE
from diagnosis.verdict import findings, validate
from facts import tells

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
        [curve] = discrepancy.curves(rows(miss, seed=seed))
        true = miss(np.array(curve["at"]))
        inside += list((np.array(curve["low"]) <= true) & (true <= np.array(curve["high"])))
    assert curve["unit"] == "share"
    assert np.mean(inside) > 0.9


def test_what_is_least_known_is_asked_for():
    """Four loads close together and one far away: the gap between them, or the far end."""
    own = rows(bump, loads=(1.0, 1.1, 1.2, 1.3, 5.6))
    asked = discrepancy.least_known(own)
    assert 1.3 < asked["levers"]["normal_stress_kPa"] < 5.6
    beyond = discrepancy.least_known(own, {"shear": {"normal_stress_kPa": (1.0, 9.0)}})
    assert beyond["levers"]["normal_stress_kPa"] > 1.3
    assert beyond["information_bits"] >= asked["information_bits"]
    # a load that was read has at most a bit left, for its own error stays
    assert asked["information_bits"] > 1.0
    assert discrepancy.least_known(rows(bump, loads=(2.0, 2.0))) is None


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
    measured = shears(lambda s: 0.6 * s * (1.0 + 4.0 * bump(s) * np.sign(s - 1.9)))
    found = identify(emulated, measured, replicates=60)
    assert found.verdict == "unexplained"
    verdict = findings(emulated, measured, found)
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
    straight = identify(emulated, shears(lambda s: 0.6 * s), replicates=60)
    assert carried(straight.models[BASE], straight.fits[BASE]) == 1
    assert carried(straight.models["cohesion"], straight.fits["cohesion"]) == 2
