"""The posterior agrees with closed forms, its ranks are uniform and its intervals hold what they
say."""

import numpy as np
import pytest
from joint_worlds import Linear
from scipy import stats
from scipy.special import expit

from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.likelihood import Response
from calibration.inference.joint.next_test import expected_information, expected_spread
from calibration.inference.posterior_sampling import Formed, Prior, sample
from calibration.statistics.design import box_behnken
from calibration.study.factors import Factor


def measured(emulator, mean, se):
    return Response("test", (emulator,), mean, se**2)


def test_a_linear_model_has_the_posterior_of_the_closed_form():
    """A normal prior and a linear response give a normal posterior: precision is the sum of the
    two."""
    b, se, sd = np.array([2.0, 1.0]), 0.1, 0.06
    prior = Prior(np.array([0.5, 0.5]), np.array([sd, sd]))
    found = sample([measured(Linear(b), 1.6, se)], prior, steps=1000)
    precision = np.eye(2) / sd**2 + np.outer(b, b) / se**2
    covariance = np.linalg.inv(precision)
    mean = covariance @ (np.full(2, 0.5) / sd**2 + b * 1.6 / se**2)
    error = np.sqrt(np.diag(covariance) / found.effective)
    assert found.converged
    assert np.abs(found.draws.mean(axis=0) - mean).max() < 5 * error.max()
    assert np.cov(found.draws.T) == pytest.approx(covariance, rel=0.15, abs=0.05 * sd**2)


class Product:
    """An emulator without error: the mean is u0 u1, whatever the others are."""

    def mean(self, u):
        return u[:, 0] * u[:, 1], np.zeros(len(u))


@pytest.mark.slow
def test_eight_parameters_that_one_target_hardly_narrows_are_sampled_well_enough():
    """Chains of stretches alone are too short where a posterior fills its box."""
    sd = 0.03
    found = sample([measured(Product(), 0.25, sd)], Prior.uniform(8))
    assert found.converged
    grid = (np.arange(2000) + 0.5) / 2000  # of u0, and of u1 in the integral
    density = stats.norm.pdf(grid[:, None] * grid, 0.25, sd).sum(axis=1)
    ends = np.interp([0.025, 0.975], np.cumsum(density) / density.sum(), grid)
    low, high = found.interval()
    assert low == pytest.approx([ends[0]] * 2 + [0.025] * 6, abs=0.03)
    assert high == pytest.approx([ends[1]] * 2 + [0.975] * 6, abs=0.03)


def test_tests_that_gave_a_value_speak_against_parameters_at_which_runs_give_none():
    """Under a flat prior the density goes with (1 - p)^tests, p the chance of no value."""
    x = np.random.default_rng(3).random((60, 2))
    chance = Chance(x, x[:, 1] > 0.6, np.ones(60))
    found = sample([Formed(chance, 10)], Prior.uniform(2), steps=1000).draws[:, 1]
    # the first input decides nothing: its weight is small, and the density is that of the second
    grid = np.linspace(0.0, 1.0, 201)
    odds = chance.with_slope(np.column_stack([np.full(201, 0.5), grid]), [])[0]
    density = (1.0 - expit(odds)) ** 10
    assert found.mean() == pytest.approx((grid * density).sum() / density.sum(), abs=0.02)
    assert np.quantile(found, 0.975) < 0.6


def response(u):
    return 40.0 + 8.0 * u[:, 0] - 3.0 * u[:, 1] + 3.0 * u[:, 0] * u[:, 1]


def trained(rng, points=24, repeats=3, sd=0.4):
    x = np.repeat(stats.qmc.Sobol(2, seed=rng).random(points + 8)[:points], repeats, axis=0)
    return GaussianProcess().fit(x, response(x) + rng.normal(0.0, 1.0, len(x)) * sd)


def test_the_emulator_finds_mean_and_scatter():
    emulator = trained(np.random.default_rng(1))
    u = np.random.default_rng(2).random((200, 2))
    mean, variance = emulator.mean(u)
    miss = mean - response(u)
    assert np.sqrt(np.mean(miss**2)) < 0.3
    assert 0.4 < np.sqrt(np.mean(miss**2 / variance)) < 2.0
    assert emulator.sd_of_run(u).mean() == pytest.approx(0.4, rel=0.25)


def test_scatter_that_varies_is_found():
    rng = np.random.default_rng(3)
    x = np.repeat(rng.random((30, 2)), 4, axis=0)
    sd = np.exp(-1.5 + 2.0 * x[:, 0])
    emulator = GaussianProcess().fit(x, response(x) + sd * rng.normal(size=len(x)))
    low, high = emulator.sd_of_run(np.array([[0.0, 0.5], [1.0, 0.5]]))
    assert low == pytest.approx(np.exp(-1.5), rel=0.5)
    assert high / low == pytest.approx(np.exp(2.0), rel=0.5)


def test_expected_information_of_normal_draws_is_shannons():
    """Half the logarithm of one plus signal over noise; nothing where the measurement does not
    vary."""
    q = stats.norm.ppf((np.arange(1500) + 0.5) / 1500)
    assert expected_information(3.0 + 2.0 * q, 0.5) == pytest.approx(
        0.5 * np.log(1.0 + 16.0), abs=0.01
    )
    assert expected_information(np.full(50, 3.0), 0.5) == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(CalibrationError, match="above 0"):
        expected_information(q, 0.0)


def test_the_expected_spread_of_normal_draws_is_the_closed_form():
    """A reading of u with error s leaves 1 / sqrt(1 + (sd/s)^2) of its sd, and all of what it does
    not depend on."""
    rng = np.random.default_rng(6)
    draws = rng.normal(0.0, [2.0, 1.0], (4000, 2))
    left = expected_spread(3.0 + draws[:, 0], 1.0, draws) / draws.std(axis=0)
    assert left[0] == pytest.approx(1.0 / np.sqrt(5.0), rel=0.06)
    assert left[1] == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_replicates_tell_the_scatter_that_few_points_hide():
    """A chain's own design: 13 points alone, one run 60 times. A process that fits its noise to the
    points follows each single run; told by the replicates, it does not."""
    rng, miss = np.random.default_rng(12), []
    single = stats.qmc.Sobol(2, seed=rng).random(16)[:13]
    x = np.vstack([single, np.full((60, 2), 0.5)])
    for _ in range(12):
        emulator = GaussianProcess().fit(x, response(x) + rng.normal(0.0, 1.5, len(x)))
        mean, variance = emulator.mean(single)
        assert emulator.sd_of_run(x).mean() == pytest.approx(1.5, rel=0.35)
        miss.append((mean - response(single)) / np.sqrt(variance))
    assert 0.5 < np.sqrt(np.mean(np.square(miss))) < 1.4


@pytest.mark.slow
def test_a_design_of_three_levels_tells_what_lies_between_them():
    """A Box-Behnken design and thirty runs at its centre, a response that levels off. A process
    that forgets between two levels answers with its mean there, up to 1.7 of the 8 off."""
    factors = [Factor(code, code, code, -1.0, 1.0) for code in "ABC"]
    design = 0.5 + 0.5 * box_behnken(factors)[list("ABC")].to_numpy(float)
    x = np.vstack([design, np.full((30, 3), 0.5)])
    between, rng = np.array([[0.5, 0.5, 0.75]]), np.random.default_rng(8)
    miss = []
    for _ in range(20):
        y = 50.0 - 8.0 * np.exp(-2.5 * x[:, 2]) + rng.normal(0.0, 0.9, len(x))
        miss.append(
            GaussianProcess().fit(x, y).mean(between)[0][0] - 50.0 + 8.0 * np.exp(-2.5 * 0.75)
        )
    # the means of the two levels beside it have standard errors of 0.45 and 0.15
    assert np.sqrt(np.mean(np.square(miss))) < 0.8
