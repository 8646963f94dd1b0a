"""The response that runs train: what two dozen say, and how far it may be off, by closed forms."""

import numpy as np
import pytest
from scipy.stats import qmc

from diagnosis.response import Response, WithMechanism

LEVELS = np.array([0.0, 0.27, 0.57, 0.83, 1.0])
STEPS = np.array([0.0, 2.0, -1.0, -4.0, 1.5])
"""What a rig does at each level besides what is smooth."""


def points(count, rng, repeated=0):
    """Two coefficients and a lever at its levels; some points twice."""
    x = qmc.LatinHypercube(3, rng=rng).random(count - repeated)
    x[:, 2] = LEVELS[(5 * x[:, 2]).astype(int)]
    return np.vstack([x, x[:repeated]])


def truth(x):
    step = STEPS[np.argmin(np.abs(x[:, 2:3] - LEVELS), axis=1)]
    return 20.0 + 10.0 * (1.0 - np.exp(-2.0 * x[:, 0])) + 3.0 * x[:, 1] * x[:, 2] + step


def trained(seed, runs=24, scatter=1.5):
    rng = np.random.default_rng(seed)
    x = points(runs, rng, runs // 4)
    z = truth(x) + scatter * rng.standard_normal(runs)
    return Response(x, z, [2]), z, rng


@pytest.mark.slow
def test_the_error_that_is_stated_is_the_error_that_is_made():
    """Over many designs the squared error is the variance, within a factor of two."""
    ratio, scatters = [], []
    for seed in range(30):
        own, _, rng = trained(seed)
        at = points(40, rng)
        value, variance = own.predict(at)
        ratio.append(np.mean((value - truth(at)) ** 2 / variance))
        scatters.append(own.scatter)
    assert 0.5 < np.mean(ratio) < 2.0
    assert np.median(scatters) == pytest.approx(1.5, rel=0.25)


def test_scatter_is_never_nothing():
    """Runs that lie on a smooth curve by chance: those that repeat a point tell the scatter."""
    for seed in range(10):
        assert trained(seed)[0].scatter > 0.5
    own, _, _ = trained(3, scatter=0.05)
    assert own.scatter < 0.5


def test_a_level_is_known_by_its_runs_and_the_steps_between_levels_are_no_scatter():
    own, _, _ = trained(1, runs=60, scatter=0.3)
    at = np.column_stack([np.full((5, 2), 0.5), LEVELS])
    value, variance = own.predict(at)
    assert value == pytest.approx(truth(at), abs=0.8)
    between = np.column_stack([np.full((1, 2), 0.5), [0.7]])
    assert own.predict(between)[1] > 2.0 * variance.max()


def test_runs_scatter_at_each_level_as_they_do_there():
    """Larger grains scatter more, and their runs count for less."""
    at = np.column_stack([np.full((5, 2), 0.5), LEVELS])
    scatter, error = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        x = points(150, rng)
        own = Response(x, truth(x) + (1.0 + 2.0 * x[:, 2]) * rng.standard_normal(150), [2])
        scatter.append(own.sd_of_run(at))
        error.append(own.predict(at)[1])
    assert np.mean(scatter, axis=0) == pytest.approx(1.0 + 2.0 * LEVELS, rel=0.25)
    first, *_, last = np.mean(error, axis=0)
    assert last > 2.0 * first


def test_many_runs_at_one_point_are_their_mean():
    """Beside them the prior and the other runs count for nothing: the mean, and its error."""
    rng = np.random.default_rng(8)
    x = points(24, rng)
    here = np.tile([0.3, 0.6, LEVELS[1]], (400, 1))
    z = np.concatenate([truth(x), truth(here)]) + 1.5 * rng.standard_normal(424)
    value, variance = Response(np.vstack([x, here]), z, [2]).predict(here[:1])
    assert value == pytest.approx(z[24:].mean(), abs=0.02)
    assert np.sqrt(variance) == pytest.approx(1.5 / np.sqrt(400), rel=0.2)


def test_a_level_beside_those_that_were_run_is_as_uncertain_as_these_differ():
    """Steps of two or so from level to level: between two of them one more of that size."""
    x = points(100, np.random.default_rng(5))
    own = Response(x, truth(x) + 0.1 * np.random.default_rng(6).standard_normal(100), [2])
    between = own.predict(np.array([[0.5, 0.5, 0.42]]))[1]
    assert np.sqrt(between) == pytest.approx(STEPS.std(), rel=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("off", [0.0, 0.4, None])
def test_what_a_mechanism_adds_is_learned_from_six_runs_as_well_as_they_tell(off):
    ratio = []
    for seed in range(20):
        own, _, rng = trained(seed, scatter=0.5)
        more = np.column_stack([points(6, rng), rng.random(6)])

        def both(x):
            t = x[:, 3] - (0.5 if off is None else off)
            return truth(x[:, :3]) + 8.0 * t + (1.5 if off is None else 0.0)

        law = WithMechanism(own, more, both(more) + 0.5 * rng.standard_normal(6), off)
        at = np.column_stack([points(20, rng), rng.random(20)])
        value, variance = law.predict(at)
        ratio.append(np.mean((value - both(at)) ** 2 / variance))
    assert 0.2 < np.mean(ratio) < 1.5


def test_a_mechanism_is_the_base_model_where_it_is_off():
    own, _, rng = trained(4)
    more = np.column_stack([points(6, rng), 0.5 + 0.5 * rng.random(6)])
    law = WithMechanism(own, more, truth(more[:, :3]), 0.0)
    at = points(5, rng)
    value = law.predict(np.column_stack([at, np.zeros(5)]))[0]
    assert value == pytest.approx(
        own.predict(at)[0], abs=1.0
    )  # its own runs tell of the base model as well
    # and of one that does nothing they say so
    strong = law.predict(np.column_stack([at, np.ones(5)]))
    assert np.abs(strong[0] - truth(at)).max() < 4.0 * np.sqrt(strong[1].max())
