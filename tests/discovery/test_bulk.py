"""Simulated tests as a table model: its densities against those of normals, what tests without a
value are expected to tell, and readings that go with something within their settings."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import multivariate_normal

from calibration.intake.measurements import Measurement
from diagnosis.bulk import Bulk
from diagnosis.laws.readings import readings_of
from diagnosis.measurements import one_by_one
from diagnosis.table_model.block import Block, Ground, Shape
from diagnosis.table_model.found import discover

N, RNG = 6, np.random.default_rng(8)


def heaps(values, sd=0.6, n=4):
    return [
        Measurement("heap", v, sd, n, {"particle_diameter_mm": 2.0 + 0.2 * k}, line=2 + k)
        for k, v in enumerate(values)
    ]


@pytest.fixture(name="block")
def grounded():
    readings = readings_of(heaps(30.0 + RNG.standard_normal(N)), "heap")
    root = 0.1 * RNG.standard_normal((N, 2))
    own = 0.01 * RNG.standard_normal((N, N))
    mean = readings.log + 0.02 * RNG.standard_normal(N)
    return Block(readings, {}, {}, Ground(mean, root, own @ own.T))


def test_densities_are_those_of_normals_of_readings_coefficients_and_simulation(block):
    ground, y = block.ground, block.readings.log + 0.03 * RNG.standard_normal((2, N))
    known = ground.root @ ground.root.T + ground.error
    found = block.base(y) - block.prior[:, None]
    for g, error in enumerate(block.errors):
        exact = multivariate_normal(ground.mean, error + known).logpdf(y)
        assert found[g, 0] - found[g, 1] == pytest.approx(exact[0] - exact[1], abs=1e-6)
    curve, more = 0.05 * RNG.standard_normal(N), 0.03 * RNG.standard_normal((N, 3))
    shape = Shape("law", np.ones(1), more[None], curve[None])
    gains = block.gains(shape, y, block.base(y))[:, 0] - block.base(y)
    for g, error in enumerate(block.errors):
        without, with_it = (
            multivariate_normal(ground.mean + c, error + known + r @ r.T).logpdf(y)
            for c, r in ((0.0 * curve, 0.0 * more), (curve, more))
        )
        assert gains[g] == pytest.approx(with_it - without, abs=1e-6)


def test_freedom_is_what_coefficients_that_are_told_leave(block):
    """Two directions that are free are told by readings of small errors, and not by coarse ones."""
    assert block.freedom() == pytest.approx(N - 2, abs=0.3)
    coarse = replace(block.readings, error=200.0 * block.readings.error)
    assert replace(block, readings=coarse).freedom() == pytest.approx(N, abs=0.2)


def test_what_tests_without_a_value_are_expected_to_tell_is_their_mean():
    class Model:
        tests = ("one", "two")

        def odds(self, theta):
            return theta[:, :1] * [1.0, -2.0], np.tile([[1.0], [-2.0]], (len(theta), 1, 1))

    bulk = Bulk.__new__(Bulk)
    tests = np.array([4.0, 9.0])
    bulk.data = type("Data", (), {"tests": tests})
    value, slope = bulk._expected_odds(Model(), np.array([0.8]))
    failed = RNG.binomial(tests.astype(int), expit([0.8, -1.6]), (400_000, 2))
    told = np.log((failed + 0.5) / (tests - failed + 0.5))
    assert value == pytest.approx(told.mean(0), abs=0.01)
    more, _ = bulk._expected_odds(Model(), np.array([0.8 + 1e-5]))
    assert slope[:, 0] == pytest.approx((more - value) / 1e-5, rel=1e-3)


HEIGHTS, WARM = (50.0, 100.0, 150.0, 200.0, 300.0, 400.0), "temperature_C"


def drops(seed, drift=0.0, hot=0.0, exchanged=False):
    """Six rebounds of each height in random order; the restitution changes by shares over the whole
    table, and over 40 degrees of a temperature that was recorded."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(np.repeat(np.arange(6), 6))
    read = {k: [] for k in range(6)}
    for line, k in enumerate(order):
        warm = rng.uniform(10.0, 50.0)
        e = 0.6 * (1.0 + drift * line / 35.0) * (1.0 + hot * (warm - 30.0) / 40.0)
        read[k].append((HEIGHTS[k] * e**2 * (1.0 + 0.02 * rng.standard_normal()), line + 2, warm))
    rows = []
    for k, own in read.items():
        values, lines, warm = map(tuple, zip(*own, strict=True))
        at = {"drop_height_mm": HEIGHTS[{1: 2, 2: 1}.get(k, k) if exchanged else k]}
        more = {"readings": values, "lines": lines, "line": lines[0]}
        more |= {"pooled": {WARM: warm}, "covariates": {WARM: np.mean(warm)}}
        rows.append(Measurement("drop", np.mean(values), np.std(values, ddof=1), 6, at, **more))
    return rows


def test_readings_that_go_with_nothing_stay_together():
    told = sum(bool(one_by_one(drops(seed))[1]) for seed in range(60))
    assert told <= 3  # 1 % is stated; four of sixty have a chance of 0.3 %


def test_wear_in_random_order_is_told_as_a_drift_of_the_rows():
    rows, told = one_by_one(drops(1, drift=-0.15))
    assert told["drop"]["of"] == "order"
    assert [m.line for m in rows] == list(range(2, 38))
    assert np.median([m.sd / m.value for m in rows]) == pytest.approx(0.02, rel=0.3)
    found = discover(rows)
    assert found.verdict == "error"
    assert [e["of"] for e in found.errors] == ["order"]
    assert found.errors[0]["share"] == pytest.approx(0.85**2 - 1.0, abs=0.06)


def test_a_temperature_that_differs_among_the_readings_is_a_law_of_it():
    rows, told = one_by_one(drops(2, hot=-0.2))
    assert told["drop"]["of"] == WARM
    found = discover(rows)
    assert (found.laws[0]["slot"], found.laws[0]["state"]) == ("restitution", [WARM])


def test_two_heights_that_were_exchanged_are_told():
    found = discover(one_by_one(drops(3, exchanged=True))[0])
    assert found.verdict == "error"
    assert found.errors[0]["exchanged"] == [100.0, 150.0]
    assert discover(drops(3)).verdict == "adequate"
