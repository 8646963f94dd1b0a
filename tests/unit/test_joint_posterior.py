"""The posterior of one target and of several: closed forms, uniform ranks, intervals that hold what
they say; it criticises itself as often as it should, and names the test that tells most."""

import numpy as np
import pytest
from joint_worlds import KINDS, Linear, World, uniform
from scipy import integrate, stats
from scipy.special import expit

from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.critique import agreement, borders, misspecification, pulls
from calibration.inference.joint.likelihood import Cloud, Joint, Response
from calibration.inference.joint.next_test import (
    Candidate,
    expected_information,
    expected_spread,
    rank,
    shares,
)
from calibration.inference.posterior_sampling import Formed, Prior, sample
from calibration.statistics.design import box_behnken
from calibration.study.factors import Factor
from joint_checks import check_ranks, coverage, simulation_based_calibration


def test_an_error_known_from_few_readings_gives_student_s_density():
    few = Response("few", Linear([1.0]), 0.0, 0.25, freedom=4)
    for u in (0.0, 0.3, 0.8, 1.0):
        known = stats.t(4, u, 0.5).logpdf(0.0)
        assert few.log_likelihood(np.array([[u]]))[0] == pytest.approx(known, abs=0.01)


def test_student_s_density_is_convolved_with_the_emulator_s_error():
    few = Response("few", Linear([1.0], error=0.4), 0.0, 0.25, freedom=5)

    def part(x):
        return stats.t(5, 0.7, 0.5).pdf(x) * stats.norm(0.0, 0.4).pdf(x)

    known = np.log(integrate.quad(part, -10, 10)[0])
    assert few.log_likelihood(np.array([[0.7]]))[0] == pytest.approx(known, abs=0.01)


def linear_study(seed, shift=0.0, d=2, tests=4, freedom=9):
    """A linear laboratory in which all tests agree but for one, moved by `shift` of its errors;
    returns it and the name of that one."""
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(tests, d))
    slopes /= np.abs(slopes).sum(axis=1, keepdims=True)
    truth, moved, found = 0.2 + 0.6 * rng.random(d), int(rng.integers(tests)), []
    for n, b in enumerate(slopes):
        estimated = 0.03**2 * rng.chisquare(freedom) / freedom
        y = b @ truth + rng.normal(0.0, np.hypot(0.03, 0.01)) + shift * 0.03 * (n == moved)
        found.append(Response(f"test {n}", Linear(b, error=0.01), y, estimated, freedom))
    return Joint(tuple(found), uniform(d)), f"test {moved}"


def judged(seed, shift):
    study, moved = linear_study(seed, shift)
    cloud = Cloud.of(study, 8000, seed)
    measured = [r.mean for r in study.responses]
    draws = cloud.draws(measured, 2000, np.random.default_rng(seed))
    found = agreement(cloud, draws, seed)
    return found["contradicts"], moved in found["named"]


@pytest.mark.slow
@pytest.mark.long  # three minutes; 98 named and 4 false on the present code
def test_tests_that_contradict_are_named_and_others_are_not():
    """Nine of ten constructed contradictions; of tests that agree one in twenty, with the error of
    200 studies."""
    false = np.mean([judged(seed, 0.0)[0] for seed in range(200)])
    named = np.mean([judged(seed, (-1) ** seed * 10.0)[1] for seed in range(100)])
    assert false <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / 200)
    assert named >= 0.9


def test_two_tests_of_one_parameter_that_exclude_each_other_are_both_named():
    low = Response("heap", Linear([1.0]), 0.3, 0.03**2)
    high = Response("drum", Linear([1.0]), 0.7, 0.03**2)
    other = Response("tilt", Linear([1.0], a=5.0), 5.3, 0.03**2)
    study = Joint((low, high), uniform(1))
    found = agreement(Cloud.of(study), study.posterior(steps=300).draws)
    assert found["contradicts"]
    assert set(found["named"]) == {"heap", "drum"}
    study = Joint((low, high, other), uniform(1))
    found = agreement(Cloud.of(study), study.posterior(steps=300).draws)
    assert found["named"] == ["drum"]
    agreeing = Joint((low, other), uniform(1))
    assert not agreement(Cloud.of(agreeing), agreeing.posterior(steps=300).draws)["contradicts"]


def test_the_pull_of_a_test_is_that_of_what_the_others_expect():
    """Two normal tests of one parameter: the pull is their difference over both errors."""
    study = Joint(
        (
            Response("a", Linear([1.0]), 0.40, 0.03**2),
            Response("b", Linear([1.0]), 0.50, 0.04**2),
        ),
        uniform(1),
    )
    found = pulls(Cloud.of(study), study.posterior(steps=600).draws)
    assert found[0]["pull_others"] == pytest.approx(-2.0, abs=0.15)
    assert found[1]["pull_others"] == pytest.approx(2.0, abs=0.15)
    assert found[0]["p_others"] == pytest.approx(2.0 * stats.norm.sf(2.0), abs=0.015)
    assert found[0]["predicted"] == pytest.approx(0.436, abs=0.01)


def test_a_posterior_that_presses_on_its_region_says_on_which_side():
    rng = np.random.default_rng(5)
    pressed = 1.0 - rng.exponential(0.04, 4000).clip(0, 1)
    inside = rng.normal(0.5, 0.1, 4000)
    flat, sloped = rng.random(4000), np.sqrt(rng.random(4000))
    found = borders(np.column_stack([pressed, inside, flat, sloped]), uniform(4))
    assert {k: side for k, (side, _) in found.items()} == {0: "high"}
    mirrored = borders(np.column_stack([1.0 - pressed]), uniform(1))
    assert {k: side for k, (side, _) in mirrored.items()} == {0: "low"}
    # an exponential tail of this length has fallen to 5 % after ln 20 lengths
    assert found[0][1] == pytest.approx(np.log(20.0) * 0.04, rel=0.1)


@pytest.mark.slow
def test_ranks_of_a_right_posterior_are_uniform_and_those_of_a_sure_one_are_not():
    study, _ = linear_study(3, tests=2)
    cloud = Cloud.of(study, 20000)
    ranks = simulation_based_calibration(study, 150, cloud=cloud)
    assert check_ranks(ranks).min() > 0.01
    # the posterior of a likelihood that is three times too sure
    rng = np.random.default_rng(1)
    truths, sure = rng.random((150, 2)), []
    for truth in truths:
        values = [r.drawn(*r.predicted(truth[None]), rng)[0] for r in study.responses]
        weights = cloud.weights(values) ** 9
        own = cloud.u[rng.choice(len(weights), 100, p=weights / weights.sum())]
        sure.append((own < truth).sum(axis=0))
    assert check_ranks(np.array(sure)).min() < 0.01


def test_what_no_parameters_give_is_misspecified():
    study, _ = linear_study(1)
    assert misspecification(study, 300) > 0.05
    far = study.at([r.mean + 3.0 for r in study.responses])
    assert misspecification(far, 300) < 0.01


def covered(kind, d, emulators, studies=30):
    """(emulators,) shares of true parameters inside their intervals. Studies that share an
    emulator, and parameters of one study, are not independent: an emulator is one reading."""
    found = []
    for seed in range(emulators):
        rng, world = np.random.default_rng([seed, d]), World(kind, d, seed)
        trained, truths = world.trained(rng, seed), rng.random((studies, d))
        measured = [world.study(u, trained, rng) for u in truths]
        cloud = Cloud.of(measured[0], 20000, seed)
        found.append(coverage(measured[0], truths, measured, cloud=cloud).mean())
    return np.array(found)


def limits(shares):
    """95 % interval of the mean share, from emulator to emulator."""
    error = stats.sem(shares) * stats.t.ppf(0.975, len(shares) - 1)
    return shares.mean() - error, shares.mean() + error


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    """94 to 96 %, with three standard errors of the number of emulators tried."""
    shares = covered("step", 1, 24)
    assert 0.94 - 3.0 * stats.sem(shares) < shares.mean() < 0.96 + 3.0 * stats.sem(shares)


def test_the_shares_of_correlated_parameters_are_those_of_the_closed_form():
    """y = x1 + x2 of normal parameters with correlation r: first share (1 + r) / 2, alone
    (1 - r) / 2 (Kucherenko and others 2012, test case 1)."""
    r, rng = 0.6, np.random.default_rng(1)
    x = rng.multivariate_normal([0, 0], [[1, r], [r, 1]], 20000)
    first, alone = shares(x.sum(axis=1), x)
    assert first == pytest.approx([0.8, 0.8], abs=0.02)
    assert alone == pytest.approx([0.2, 0.2], abs=0.02)


def candidates(slopes, scatter=0.1):
    return [
        Candidate(name, "response", Linear(b, scatter=scatter), 5, hours)
        for name, (b, hours) in slopes.items()
    ]


def test_where_heap_and_drum_tell_the_same_the_discharge_comes_first():
    """The heap has fixed the sum of friction and rolling friction; the drum tells it again."""
    heap = Response("heap", Linear([1.0, 1.0]), 1.0, 0.02**2)
    draws = Joint((heap,), uniform(2)).posterior(steps=600).draws
    told = rank(candidates({"drum": ([1.0, 1.1], 1.0), "discharge": ([1.0, 0.3], 1.0)}), draws)
    assert [t.candidate.rig for t in told] == ["discharge", "drum"]
    assert told[0].left.max() < 0.5 < told[1].left.min()
    # ten hours for it turn the order
    slow = candidates({"drum": ([1.0, 1.3], 1.0), "discharge": ([1.0, 0.3], 40.0)})
    assert rank(slow, draws)[0].candidate.rig == "drum"


def test_for_a_machine_the_test_counts_that_tells_of_its_prediction():
    draws = np.random.default_rng(1).random((400, 2))
    tests = candidates({"a": ([1.0, 0.0], 1.0), "b": ([0.0, 0.9], 1.0)})
    assert rank(tests, draws)[0].candidate.rig == "a"
    told = rank(tests, draws, prediction=Linear([0.1, 1.0]))
    assert told[0].candidate.rig == "b"
    assert told[0].prediction_left < 0.3


def measured(emulator, mean, se):
    return Response("test", emulator, mean, se**2)


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
    found = sample([measured(Product(), 0.25, sd)], uniform(8))
    assert found.converged
    grid = (np.arange(2000) + 0.5) / 2000  # of u0, and of u1 in the integral
    density = stats.norm.pdf(grid[:, None] * grid, 0.25, sd).sum(axis=1)
    ends = np.interp([0.025, 0.975], np.cumsum(density) / density.sum(), grid)
    low, high = found.interval(0.95)
    assert low == pytest.approx([ends[0]] * 2 + [0.025] * 6, abs=0.03)
    assert high == pytest.approx([ends[1]] * 2 + [0.975] * 6, abs=0.03)


def test_tests_that_gave_a_value_speak_against_parameters_at_which_runs_give_none():
    """Under a flat prior the density goes with (1 - p)^tests, p the chance of no value."""
    x = np.random.default_rng(3).random((60, 2))
    chance = Chance(x, x[:, 1] > 0.6, np.ones(60))
    found = sample([Formed(chance, 10)], uniform(2), steps=1000).draws[:, 1]
    # the first input decides nothing: its weight is small, and the density is that of the second
    grid = np.linspace(0.0, 1.0, 201)
    odds = chance.predict(np.column_stack([np.full(201, 0.5), grid]))[0]
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


def test_a_run_that_is_left_out_is_missed_as_by_a_process_without_it():
    rng = np.random.default_rng(4)
    x = rng.random((40, 2))
    y = response(x) + rng.normal(0.0, 0.4, 40)
    whole = GaussianProcess().fit(x, y)
    error, sd = whole.left_out()
    for k in (0, 31):
        rest = GaussianProcess().fit(np.delete(x, k, 0), np.delete(y, k), whole.known)
        [mean], [variance] = rest.mean(x[[k]])
        assert error[k] == pytest.approx(mean - y[k], rel=1e-4)
        assert sd[k] == pytest.approx(np.hypot(variance**0.5, rest.sd_of_run(x[[k]])[0]), 1e-4)


def test_expected_information_of_normal_draws_is_shannons():
    """Half the logarithm of one plus signal over noise; nothing where the measurement does not
    vary."""
    q = stats.norm.ppf((np.arange(1500) + 0.5) / 1500)
    assert expected_information(3.0 + 2.0 * q, 0.5) == pytest.approx(
        0.5 * np.log(1.0 + 16.0), abs=0.01
    )
    assert expected_information(np.full(50, 3.0), 0.5) == pytest.approx(0.0, abs=1e-6)


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


if __name__ == "__main__":  # the table of coverage: python tests/unit/test_joint_posterior.py
    for d, emulators in ((1, 40), (3, 20), (8, 10)):
        for kind in KINDS:
            found = covered(kind, d, emulators)
            low, high = limits(found)
            shown = f"{100 * found.mean():.1f} %, {100 * low:.1f} to {100 * high:.1f}"
            print(kind, d, shown, f"of {emulators} emulators", flush=True)
