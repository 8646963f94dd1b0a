"""The Gaussian process is scikit-learn's."""

import warnings

import numpy as np
import pytest
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

from calibration.process import (
    JITTER,
    LENGTH,
    LINEAR,
    NOISE,
    OFFSET,
    SCALE,
    START,
    fit_process,
)


def data(d, n):
    """Inputs (n, d) and standardised responses (n,) with noise."""
    rng = np.random.default_rng(d)
    x = rng.random((n, d))
    z = np.sin(3.0 * x).sum(axis=1) + x[:, 0] ** 2 + 0.1 * rng.standard_normal(n)
    return x, (z - z.mean()) / z.std()


def theirs(x, z, noise):
    """scikit-learn's fit; noise: variances (n,) that are known, or None for one to be found."""
    kernel = ConstantKernel(START[0], SCALE) * RBF(np.full(x.shape[1], START[1]), LENGTH)
    kernel += ConstantKernel(START[2], LINEAR) * DotProduct(START[3], OFFSET)
    if noise is None:
        kernel += WhiteKernel(START[4], NOISE)
    known = JITTER if noise is None else noise + JITTER
    process = GaussianProcessRegressor(kernel, alpha=known, n_restarts_optimizer=1, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is no fault
        return process.fit(x, z)


@pytest.mark.parametrize(("d", "n"), [(1, 8), (3, 40)])
def test_the_process_is_that_of_scikit_learn(d, n):
    x, z = data(d, n)
    ours, found = fit_process(x, z, np.ones(n)), theirs(x, z, None)
    smooth, trend = found.kernel_.k1.k1, found.kernel_.k1.k2
    assert ours.scale == pytest.approx(smooth.k1.constant_value, rel=1e-5)
    assert ours.length == pytest.approx(np.atleast_1d(smooth.k2.length_scale), rel=1e-5)
    assert ours.linear == pytest.approx(trend.k1.constant_value, rel=1e-5)
    assert ours.offset == pytest.approx(trend.k2.sigma_0**2, rel=1e-5)
    assert ours.noise == pytest.approx(found.kernel_.k2.noise_level, rel=1e-5)
    assert ours.covariance == pytest.approx(found.kernel_(x), rel=1e-5)
    assert ours.alpha == pytest.approx(found.alpha_, rel=1e-4)


def test_a_known_variance_of_a_run_weighs_the_means():
    x, z = data(2, 30)
    runs, noise = np.arange(30) % 4 + 1.0, 0.05
    ours, found = fit_process(x, z, runs, noise), theirs(x, z, noise / runs)
    assert ours.noise == noise
    assert ours.length == pytest.approx(found.kernel_.k1.k2.length_scale, rel=1e-5)
    assert ours.alpha == pytest.approx(found.alpha_, rel=1e-4)
