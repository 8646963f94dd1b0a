"""The misfit of each experiment, and names that fall by left-out settings, by the closed form of
linear models."""

import numpy as np
import pytest
from linear_model import Linear

from calibration.intake.measurements import Measurement
from diagnosis import extend
from diagnosis.extend import FIT, _as_known, gain, held_out_fits, refit_errors
from diagnosis.fit import data_of, fit
from diagnosis.rules import OF_SIMULATED, by_runs

SD, REPLICATES, READINGS = 50.0, 10_000, 40  # so many that the spread is known
MEAN_ERROR = SD / np.sqrt(REPLICATES)


def fitted(times):
    """Fit of a level for the heaps and one for the tilts, whose readings scatter by `times` the
    error that they state; every other reading is of a tilt."""
    rng = np.random.default_rng(4)
    tilt = np.arange(READINGS) % 2 == 1
    off = rng.standard_normal(READINGS)
    for own in (tilt, ~tilt):  # the sample has just the spread that is asked for
        off[own] = (off[own] - off[own].mean()) / off[own].std(ddof=1)
    values = 30.0 + MEAN_ERROR * np.where(tilt, times, 1.0) * off
    model = Linear(np.column_stack([~tilt, tilt]).astype(float))
    model.prior_mean[:], model.prior_sd[:] = 30.0, 1e3
    own = [
        Measurement(kind, v, SD, REPLICATES, {"particle_diameter_mm": 2.0 + 0.01 * i})
        for i, (kind, v) in enumerate(zip(np.where(tilt, "tilt", "heap"), values, strict=True))
    ]
    return fit(model, data_of(own))


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_an_interval_is_widened_by_the_misfit_of_its_own_experiment(times):
    """The mean of n readings whose errors are sigma is known to sigma / sqrt(n)."""
    found = fitted(times)
    sd = np.sqrt(np.diag(found.cov[0]))
    known = MEAN_ERROR / np.sqrt(0.5 * READINGS)
    assert sd == pytest.approx([known, times * known], rel=1e-3)


X = np.array([0.0, 1.0, 2.0, 6.0])
DESIGN = np.column_stack([np.ones(4), X])
OWN_ERROR = 0.5  # of a reading; so many replicates that it is known
RUNS, SCATTER = 2, 0.6  # runs at a setting, and what they scatter by
TABLES = 100


def table(values):
    return [
        Measurement(
            "heap", v, OWN_ERROR * np.sqrt(REPLICATES), REPLICATES, {"particle_diameter_mm": x}
        )
        for v, x in zip(values, 2.0 + X, strict=True)
    ]


def line():
    model = Linear(DESIGN)
    model.prior_mean[:], model.prior_sd[:] = 0.0, 1e3
    return model


def test_the_refit_leaves_open_what_a_regression_says():
    """x (X'X)^-1 x sigma^2 of the other rows."""
    model, data = line(), data_of(table(30.0 + 2.0 * X))
    found = refit_errors(model, data, held_out_fits(model, data))
    for i, x in enumerate(DESIGN):
        others = np.delete(DESIGN, i, axis=0)
        assert found[i] ** 2 == pytest.approx(
            data.error[0, i] ** 2 * x @ np.linalg.inv(others.T @ others) @ x
        )


class Shifted(Linear):
    """Emulators that are all wrong by one shift of standard deviation 0.8."""

    def predict(self, theta, errors=True):
        value, error = super().predict(theta, errors)
        return value, error + 0.8

    def error_correlation(self, theta):
        return np.ones((len(self.x), len(self.x)))


def test_a_shift_that_all_emulators_share_does_not_average_out():
    """A level that is fitted takes the whole shift, and the engine has none of it."""
    model = Shifted(np.ones((4, 1)))
    model.prior_mean[:], model.prior_sd[:] = 30.0, 1e3
    data = data_of(table(np.full(4, 30.0)))
    found = refit_errors(model, data, held_out_fits(model, data))
    assert found**2 == pytest.approx(np.full(4, 0.8**2 + OWN_ERROR**2 / 3), rel=1e-4)


def withdrawn(curve):
    """(share of tables whose name is withdrawn, the same were the refit not counted, their misses
    in all errors) of a line that is fitted to nature, a function of X; the engine runs the line."""
    rng, model = np.random.default_rng(5), line()
    fell, before, misses = [], [], []
    for _ in range(TABLES):
        rows = table(30.0 + curve(X) + OWN_ERROR * rng.standard_normal(4))
        data = data_of(rows)
        fits = held_out_fits(model, data)
        mean = (fits.theta * DESIGN).sum(1)
        after = mean[:, None] + SCATTER * rng.standard_normal((4, RUNS))
        # without the law the engine has no slope
        found = gain(rows, after + 9.0, after, refit=refit_errors(model, data, fits))
        verdict = {"verdict": "identified", "causes": ["cohesion"], "gain": found, "ranking": []}
        fell.append(by_runs(verdict, OF_SIMULATED)["verdict"] != "identified")
        before.append(found["held_out_rmse_after"] > FIT)
        refit = np.array([p["refit"] for p in found["points"]])
        known = np.sqrt(OWN_ERROR**2 + SCATTER**2 / RUNS + refit**2)
        misses.append([(p["measured"] - p["after"]) / k
                       for p, k in zip(found["points"], known, strict=True)])  # fmt: skip
    return np.mean(fell), np.mean(before), np.array(misses)


@pytest.mark.slow
def test_a_law_that_is_right_keeps_its_name_and_a_wrong_one_does_not(monkeypatch):
    """The misses of the right law have the spread that is stated, so that its name falls in no more
    of data than one setting exceeds FIT: 0.3 %. Without the refit's errors one name in ten fell."""
    monkeypatch.setattr(extend, "RESAMPLES", 40)  # of intervals, which decide nothing here
    fell, before, misses = withdrawn(lambda x: 2.0 * x)
    assert np.sqrt(np.mean(misses**2, axis=0)) == pytest.approx(np.ones(4), abs=0.2)
    assert fell * TABLES <= 2  # of 0.3 expected at most; more have a chance below 0.3 %
    assert before > 0.1
    fell, _, _ = withdrawn(lambda x: 60.0 * np.sin(1.5 * x))
    assert fell > 0.95


def test_a_spread_that_few_runs_tell_is_passed_as_seldom_as_one_that_is_known():
    rng, draws, rows = np.random.default_rng(6), 40_000, table(np.full(4, 30.0))
    values = rng.standard_normal((4, RUNS))
    wide = _as_known(rows, values)
    freedom = 4 * (RUNS - 1)
    told = np.sqrt(rng.chisquare(freedom, draws) / freedom)
    passed = np.mean(np.abs(rng.standard_normal(draws)) > FIT * told * wide[0])
    assert passed == pytest.approx(0.0027, abs=0.001)
