"""Odds of one model against another and of errors of the set-up, and the misfit of each experiment,
by the closed form of linear models."""

import numpy as np
import pytest
from linear_model import Linear
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from calibration.intake.measurements import Measurement
from diagnosis.fit import Data, data_of, fit
from diagnosis.set_up_errors import EVERY, ONE, SIZES, log_evidence, set_up_errors

N, ERROR = 6, 1.5


def drawn(columns):
    rng = np.random.default_rng(5)
    value = rng.normal(size=(1, N))
    return Linear(rng.normal(size=(N, columns))), Data(value, np.full((1, N), ERROR))


def density(model, data, error):
    """Of the readings with all parameters integrated out; error: (n,) variances."""
    mean = model.x @ model.prior_mean
    covariance = model.x @ np.diag(model.prior_sd**2) @ model.x.T + np.diag(error)
    return multivariate_normal(mean, covariance).logpdf(data.value[0])


@pytest.mark.parametrize("times", [1.0, 6.0])
def test_odds_of_two_linear_models_are_those_of_their_marginal_normals(times):
    """Whether they fit or not."""
    models, data = [drawn(1)[0], drawn(3)[0]], drawn(1)[1]
    data.value[0] *= times
    found = [log_evidence(model, data, fit(model, data))[0] for model in models]
    one, two = (density(model, data, np.full(N, ERROR**2)) for model in models)
    assert found[0] - found[1] == pytest.approx(one - two, abs=1e-3)


@pytest.mark.parametrize("off", [0.0, 12.0])
def test_errors_of_the_set_up_are_weighed_as_normals_of_every_size(off):
    model, data = drawn(2)
    data.value[0, 3] += off * ERROR
    own = np.full(N, ERROR**2)
    plain = density(model, data, own)
    every = [density(model, data, own * (1.0 + s**2)) for s in SIZES]
    one = [[density(model, data, own * (1.0 + s**2 * row)) for s in SIZES] for row in np.eye(N)]
    found = set_up_errors(model, data, fit(model, data))
    exact = logsumexp(every) - np.log(len(SIZES)) - plain
    assert found[EVERY] == pytest.approx(exact, abs=1e-6)
    exact = logsumexp(one) - np.log(N * len(SIZES)) - plain
    assert found[ONE] == pytest.approx(exact, abs=1e-6)
    assert off == 0.0 or found[ONE] > found[EVERY] > 0.0


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
    return fit(model, data_of(own)), tilt


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_the_scale_is_that_of_the_experiment(times):
    found, tilt = fitted(times)
    assert found.scale[0, ~tilt] == pytest.approx(1.0, abs=1e-3)
    assert found.scale[0, tilt] == pytest.approx(times, rel=1e-3)


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_an_interval_is_widened_by_the_misfit_of_its_own_experiment(times):
    """The mean of n readings whose errors are sigma is known to sigma / sqrt(n)."""
    found, _ = fitted(times)
    sd = np.sqrt(np.diag(found.cov[0]))
    known = MEAN_ERROR / np.sqrt(0.5 * READINGS)
    assert sd == pytest.approx([known, times * known], rel=1e-3)
