"""The posterior agrees with closed forms, its ranks are uniform and its intervals hold what they
say."""

import json
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.special import expit

from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.information import expected_information, expected_spread
from calibration.inference.posterior_sampling import (
    Formed,
    Measured,
    Prior,
    sample,
    sobol_indices,
)
from calibration.inference.scatter_emulator import ScatterEmulator
from calibration.statistics.design import box_behnken
from calibration.study.config.schema import PosteriorConfig, Target, TestConfig
from calibration.study.factors import Factor
from facts import refused, tells


class Linear:
    """An emulator without error: the mean is a + b u."""

    def __init__(self, a, b):
        self.a, self.b = a, np.asarray(b, float)

    def mean(self, u):
        return self.a + u @ self.b, np.zeros(len(u))


def test_a_linear_model_has_the_posterior_of_the_closed_form():
    """A normal prior and a linear response give a normal posterior: precision is the sum of the
    two."""
    b, se, sd = np.array([2.0, 1.0]), 0.1, 0.06
    prior = Prior(np.array([0.5, 0.5]), np.array([sd, sd]))
    found = sample([Measured(Linear(0.0, b), 1.6, se)], prior, steps=1000)
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
    found = sample([Measured(Product(), 0.25, sd)], Prior.uniform(8))
    assert found.converged
    grid = (np.arange(2000) + 0.5) / 2000  # of u0, and of u1 in the integral
    density = stats.norm.pdf(grid[:, None] * grid, 0.25, sd).sum(axis=1)
    ends = np.interp([0.025, 0.975], np.cumsum(density) / density.sum(), grid)
    low, high = found.interval()
    assert low == pytest.approx([ends[0]] * 2 + [0.025] * 6, abs=0.03)
    assert high == pytest.approx([ends[1]] * 2 + [0.975] * 6, abs=0.03)


def test_two_targets_fix_what_one_leaves_open():
    one = Measured(Linear(0.0, [1.0, 1.0]), 1.0, 0.02)
    two = Measured(Linear(0.0, [1.0, -1.0]), 0.2, 0.02)
    alone = sample([one], Prior.uniform(2), steps=400)
    both = sample([one, two], Prior.uniform(2), steps=400)
    assert alone.draws.std(axis=0).min() > 0.2  # the set from (0, 1) to (1, 0)
    assert both.draws.std(axis=0).max() < 0.03
    assert both.draws.mean(axis=0) == pytest.approx([0.6, 0.4], abs=0.01)


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


def ranks(truths, posteriors, thin):
    """Rank (k, d) of each true u (k, d) among `thin` draws of its posterior: uniform on 0 to thin
    where the posterior is right (simulation-based calibration: Talts et al. 2018,
    arXiv:1804.06788)."""
    found = []
    for truth, posterior in zip(truths, posteriors, strict=True):
        pick = np.linspace(0, len(posterior.draws) - 1, thin).round().astype(int)
        found.append((posterior.draws[pick] < truth).sum(axis=0))
    return np.array(found)


def response(u):
    return 40.0 + 8.0 * u[:, 0] - 3.0 * u[:, 1] + 3.0 * u[:, 0] * u[:, 1]


def trained(rng, points=24, repeats=3, sd=0.4):
    x = np.repeat(stats.qmc.Sobol(2, seed=rng).random(points + 8)[:points], repeats, axis=0)
    return ScatterEmulator(x, response(x) + rng.normal(0.0, 1.0, len(x)) * sd)


def test_the_emulator_finds_mean_and_scatter():
    emulator = trained(np.random.default_rng(1))
    u = np.random.default_rng(2).random((200, 2))
    mean, variance = emulator.mean(u)
    miss = mean - response(u)
    assert np.sqrt(np.mean(miss**2)) < 0.3
    assert 0.4 < np.sqrt(np.mean(miss**2 / variance)) < 2.0
    assert emulator.scatter(u).mean() == pytest.approx(0.4, rel=0.25)


def test_scatter_that_varies_is_found():
    rng = np.random.default_rng(3)
    x = np.repeat(rng.random((30, 2)), 4, axis=0)
    sd = np.exp(-1.5 + 2.0 * x[:, 0])
    emulator = ScatterEmulator(x, response(x) + sd * rng.normal(size=len(x)))
    low, high = emulator.scatter(np.array([[0.0, 0.5], [1.0, 0.5]]))
    assert low == pytest.approx(np.exp(-1.5), rel=0.5)
    assert high / low == pytest.approx(np.exp(2.0), rel=0.5)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    """Of the emulated posterior's 95 % interval over the runs, the measurement and the truth, all
    drawn anew. One parameter, so that the posterior is had on a grid and the sampler's noise stays
    out."""
    rng, inside, draws = np.random.default_rng(4), 0, 150
    grid = np.linspace(0.0, 1.0, 801)[:, None]
    for _ in range(draws):
        x = np.repeat(np.linspace(0.0, 1.0, 9), 3)[:, None]
        y = 40 + 8 * x[:, 0] + 2 * np.sin(3 * x[:, 0]) + rng.normal(0, 0.5, len(x))
        truth = rng.random()
        mean = 40 + 8 * truth + 2 * np.sin(3 * truth) + rng.normal(0, 0.3)
        value = Measured(ScatterEmulator(x, y), mean, 0.3).log_likelihood(grid)
        weight = np.cumsum(np.exp(value - value.max()))
        inside += 0.025 <= np.interp(truth, grid[:, 0], weight / weight[-1]) <= 0.975
    assert stats.binomtest(inside, draws, 0.95).pvalue > 0.001


def test_sobols_g_function():
    """First-order and total indices in closed form: V_i = 1 / (3 (1 + a_i)^2), V = prod (1 + V_i) -
    1 (Saltelli and Sobol 1995, Reliability Engineering and System Safety 50:225)."""
    a = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])
    part = 1.0 / (3.0 * (1.0 + a) ** 2)
    whole = np.prod(1.0 + part) - 1.0
    total = part * np.prod(1.0 + part) / (1.0 + part) / whole

    def g(u):
        return np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1)

    found = sobol_indices(g, list("ABCDEFGH"))
    for k, row in enumerate(found.values()):
        assert row["first"] == pytest.approx(part[k] / whole, abs=0.02)
        assert row["total"] == pytest.approx(total[k], abs=0.02)
    with pytest.raises(CalibrationError, match="constant"):
        sobol_indices(lambda u: np.ones(len(u)), ["A", "B"])


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
        emulator = ScatterEmulator(x, response(x) + rng.normal(0.0, 1.5, len(x)))
        mean, variance = emulator.mean(single)
        assert emulator.scatter(x).mean() == pytest.approx(1.5, rel=0.35)
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
        miss.append(ScatterEmulator(x, y).mean(between)[0][0] - 50.0 + 8.0 * np.exp(-2.5 * 0.75))
    # the means of the two levels beside it have standard errors of 0.45 and 0.15
    assert np.sqrt(np.mean(np.square(miss))) < 0.8


REGION = [
    {"code": c, "name": n, "key": f"contacts.{n}", "low": 0.2, "high": 0.6}
    for c, n in (("A", "first"), ("B", "second"))
]


class Asked(SimpleNamespace):
    """A configuration, which makes its target anew whenever it is asked for."""

    @property
    def target(self):
        return Target(metric="angle_of_repose_deg")


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    """A finished chain of two factors in a folder: its angle depends on the first alone, the grains
    on the plate on the second alone. The configuration and the stage's outputs."""
    from calibration.chain import posterior as stage

    tmp_path = tmp_path_factory.mktemp("chain")
    optimum = {"region": REGION, "optimum": {"first": 0.4, "second": 0.4}}
    (tmp_path / "optimum.json").write_text(json.dumps(optimum))
    rng = np.random.default_rng(5)
    levels = np.repeat(0.2 + 0.4 * rng.random((18, 2)), 2, axis=0)
    table = pd.DataFrame(levels, columns=["first", "second"])
    table["run_id"] = [f"heap-{k}" for k in range(len(table))]
    table.to_csv(tmp_path / "design.csv", index=False)
    angle = 30 + 25 * table["first"] + 5 * table["second"] + rng.normal(0, 0.3, len(table))
    plate = 900 + 400 * table["second"] + rng.normal(0, 8, len(table))
    config = Asked(
        seed=1,
        experiment="heap",
        further_targets=[],
        own="heap",
        own_run={"particles": {"count": 1200}},
        tests={"heap": TestConfig(experiment="heap")},
        posterior=PosteriorConfig(draws=60, priors={"second": {"mean": 0.4, "sd": 0.05}}),
    )
    values = {"angle_of_repose_deg": angle.to_numpy(), "on_plate": plate.to_numpy()}
    missing = np.full(len(angle), np.nan)
    names = {"summary": "p.json"} | {n: f"{n}.csv" for n in ("draws", "parameters", "next")}
    names |= {n: f"{n}.svg" for n in ("pairs", "pushed", "following")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stage, "with_responses", lambda t, c: t.assign(response=angle))
        patch.setattr(stage, "read_values", lambda ids, name: values.get(name, missing))
        patch.setattr(stage, "read_target", lambda c, t: np.array([41.8, 42.2, 41.9, 42.1]))
        yield config, SimpleNamespace(**{n: tmp_path / file for n, file in names.items()})


def analysed(config, output):
    from calibration.chain.posterior import posterior

    folder = output.summary.parent
    source = SimpleNamespace(designs=[folder / "design.csv"], optimum=folder / "optimum.json")
    posterior(SimpleNamespace(config=config), source, output)
    return json.loads(output.summary.read_text())


@pytest.fixture(scope="module")
def answer(chain):
    """The summary of the finished chain."""
    return analysed(*chain)


def test_the_stage_writes_the_answer(chain, answer):
    config, output = chain
    found = answer
    first = found["parameters"]["first"]
    # 30 + 25 x + 5 * 0.4 = 42 at x = 0.4, known as well as the second factor lets it
    assert first["interval"][0] < 0.4 < first["interval"][1]
    assert first["sd"] < 0.03
    assert first["bounded"]
    assert found["parameters"]["second"]["sd"] == pytest.approx(0.05, rel=0.2)
    assert found["sobol"]["first"]["total"] > 0.8
    low, high = found["pushed_forward"]["mean"]
    first, last = found["pushed_forward"]["run"]
    assert first < low < 42.0 < high < last
    assert last - first == pytest.approx(2 * 1.96 * np.hypot(0.3, (high - low) / 3.92), rel=0.35)
    draws = pd.read_csv(output.draws)
    assert len(draws) == 60
    assert draws["predicted"].mean() == pytest.approx(42.0, abs=0.4)
    for picture in (output.pairs, output.pushed, output.following):
        assert picture.read_text().count("<path") > 5
    config = deepcopy(config)
    config.posterior.priors["stray"] = config.posterior.priors["second"]
    with refused(CalibrationError, "posterior.priors", "stray", "first", "second"):
        analysed(config, output)


def test_what_is_weighed_tells_what_the_angle_leaves_open(answer):
    """Five readings of the mass tell the second parameter to 8 / sqrt(5) / 400 = 0.009, of 0.05."""
    from calibration.chain.posterior_words import sentences
    from calibration.figures import ANGLE

    best = answer["next_experiment"][0]
    assert best["metric"] == "on_plate"
    assert best["second left"] < 0.35
    again = next(r for r in answer["next_experiment"] if r["metric"] == "angle_of_repose_deg")
    assert again["measured"]
    assert again["second left"] > 0.8
    said = " ".join(sentences(answer, ANGLE))
    assert tells(said, "mass on", "weighing")
    assert tells(said, "5 readings", "on the plate")
    assert "first 0.3" in said
    # 400 grains a unit of a parameter known to 0.05, about 1060 of 1200 at 0.4
    low, high = best["low"], best["high"]
    assert tells(said, f"{low:.0f} to {high:.0f}", f"{100 * low / 1200:.1f} to")


@pytest.mark.slow
def test_runs_without_a_value_count_against_their_parameters(chain, answer, monkeypatch):
    from calibration.chain import posterior as stage
    from calibration.chain.posterior_words import sentences
    from calibration.figures import ANGLE

    before = answer
    assert before["without_value"] == []
    values = stage.with_responses
    steep = 0.42  # of the first factor, above which no heap forms
    monkeypatch.setattr(
        stage,
        "with_responses",
        lambda t, c: values(t, c).assign(
            response=lambda d: d["response"].where(d["first"] < steep)
        ),
    )
    monkeypatch.setattr(stage, "reason_without", lambda name: "no heap formed")
    found = analysed(*chain)
    left = found["without_value"]
    assert {row["reason"] for row in left} == {"no heap formed"}
    assert found["trained_by"] + len(left) == before["trained_by"]
    ends = [s["parameters"]["first"]["interval"][1] for s in (before, found)]
    assert ends[1] < ends[0] - 0.005
    lost = f"{len(left)} of {before['trained_by']}"
    assert tells(" ".join(sentences(found, ANGLE)), lost, "no value")
