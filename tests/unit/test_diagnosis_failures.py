"""Tests that end without a value are evidence: the chance of it is learnt from the runs that
failed."""

import json
import math
import types

import numpy as np
import pytest
from diagnosis_cases import BASE as RUN
from diagnosis_cases import FACTORS, closed_form, trained
from scipy.special import expit
from scipy.stats import binom

from benchmarks.rates.simulated import salt_settings
from calibration.inference.chance_of_no_value import Chance, log_likelihood
from calibration.intake.measurements import Measurement
from diagnosis import emulator_waves, setup
from diagnosis.bulk import Bulk
from diagnosis.emulator import train_failures
from diagnosis.extend import extension_plan
from diagnosis.rig import Rig
from diagnosis.settings import BASE, catalogue_of, parameters_of
from diagnosis.verdict import extension, findings

CLOGS_AT_MM, COARSE = 2.6, 2.0
"""True diameter from which the funnel clogs; grains of a run over those that they stand for."""


def true_odds(x):
    return -2.0 + 5.0 * x[:, 0] - 3.0 * x[:, 1]


def test_the_chance_is_that_of_the_runs():
    rng = np.random.default_rng(1)
    x = rng.random((800, 2))
    chance = Chance(x, rng.binomial(4, expit(true_odds(x))), np.full(800, 4))
    at = rng.random((50, 2))
    odds = chance.predict(at)[0]
    assert np.abs(expit(odds) - expit(true_odds(at))).max() < 0.05


def test_the_likelihood_is_the_binomial():
    odds, failed = np.array([-1.0, 0.3]), np.array([2.0, 0.0])
    exact = binom.logpmf(failed, 5, expit(odds)) - np.log([10.0, 1.0])
    assert log_likelihood(odds, failed, np.array([5.0, 5.0])) == pytest.approx(exact)


def clogging(kinds=("heap",)):
    """`Emulated` of heaps by closed forms, of which the runs of large grains clog."""
    changes = {
        "runs": 200,
        "experiments": {
            "heap": {
                "levers": {"particle_diameter_mm": [1.6, 2.8]},
                "mechanisms": ["size_bias", "cohesion"],
                "run": {"geometry": {"orifice_diameter_mm": 30}},
            }
        },
    }
    settings = salt_settings(changes)
    known = {
        k: m for k, m in catalogue_of(settings, kinds).items() if k in ("size_bias", "cohesion")
    }
    factors = parameters_of(settings, FACTORS, kinds)
    rig = Rig(settings, RUN, factors)
    return trained(rig, known, kinds, lambda s: None if clogs(s) else closed_form(s))


def clogs(spec):
    grains = spec["particles"]
    return grains["diameter_mm"] * grains["scale_factor"] / COARSE > CLOGS_AT_MM


@pytest.fixture(scope="module")
def emulated():
    return clogging()


def test_runs_that_blow_up_are_no_tests(tmp_path, monkeypatch):
    """Half of the large grains clog; where the other half blew up, the chance is of the rest."""
    rng = np.random.default_rng(4)
    rows = [
        {"experiment": "heap", "mechanism": BASE, "inputs": [x, 0.5], "run_ids": [f"r{k}"]}
        for k, x in enumerate(rng.random(200))
    ]
    large = [r["run_ids"][0] for r in rows if r["inputs"][0] > 0.5]
    metrics = {r["run_ids"][0]: {"angle_of_repose_deg": 30.0} for r in rows}
    metrics |= dict.fromkeys(large[::2])
    settings = salt_settings()

    def chance(faults):
        trained = train_failures(rows, metrics, {}, faults)
        return trained["heap", BASE] if trained else None

    clogged = chance(())
    assert (clogged.failed, clogged.runs) == (len(large[::2]), 200)
    assert chance(large[::2]) is None
    part = chance(large[::4])
    assert (part.failed, part.runs) == (len(large[2::4]), 200 - len(large[::4]))
    # the stage asks the kept failures which runs these are
    monkeypatch.setattr(setup, "train", lambda *_: ({}, []))
    monkeypatch.setattr(setup, "untested", set)
    monkeypatch.setattr(setup, "simulate", lambda specs: metrics)
    design, plan = tmp_path / "design.json", tmp_path / "plan.json"
    design.write_text(json.dumps(rows))
    plan.write_text(json.dumps({key: {"experiment": "heap"} for key in metrics}))
    rig = types.SimpleNamespace(factors=[], settings=settings)
    own = types.SimpleNamespace(settings=settings, rig=rig, catalogue={}, measurements=[])
    emulated, _ = setup.Setup.emulated(own, [design], [plan])
    assert emulated.failures == {}


SIZES = (1.7, 1.9, 2.1, 2.3, 2.5)
SETTINGS = salt_settings()
PAIRS = ("particle_particle", "particle_wall")


def heaps(bias, outcomes=True, seed=5):
    """Heaps of grains that are `bias` times what they are said to be; those that clog have an
    outcome. The angle does not depend on the size."""
    rng, rows = np.random.default_rng(seed), []
    middle = {f.key: f.natural(0.0) for f in parameters_of(SETTINGS, FACTORS, ["heap"])}
    pair, wall = (middle[f"contacts.{p}.rolling_friction"] for p in PAIRS)
    true = closed_form(
        {
            "experiment": "heap",
            "geometry": {},
            "particles": {"diameter_mm": 2.0},
            "contacts": {
                "particle_particle": {"rolling_friction": pair},
                "particle_wall": {"rolling_friction": wall},
            },
        }
    )["angle_of_repose_deg"]
    for d in SIZES:
        if d * bias > CLOGS_AT_MM:
            own = {"outcome": "clogged", "line": 7}
            rows.append(
                Measurement("heap", math.nan, math.nan, 4, {"particle_diameter_mm": d}, **own)
            )
        else:
            angle = true + 0.4 * rng.standard_normal()
            rows.append(Measurement("heap", angle, 0.8, 4, {"particle_diameter_mm": d}))
    return [r for r in rows if outcomes or not r.outcome]


def test_grains_that_are_too_large_clog(emulated):
    """The angles alone say nothing of the size; the three sizes that clog do."""
    silent = Bulk(emulated, heaps(1.3, outcomes=False)).judged()
    assert silent.verdict == "adequate"
    bulk = Bulk(emulated, heaps(1.3))
    found = bulk.judged()
    assert found.ranking[0]["mechanism"] == "size_bias"
    assert found.ranking[0]["gain"] > silent.ranking[0]["gain"] + 4.0
    assert found.p < 0.025
    assert found.causes == ["size_bias"]
    findings(bulk, found, extension(bulk, found), 0.05)
    strength = found.ranking[0]["strength"]["size_bias"]
    assert strength["low"] > 1.0


def test_grains_of_the_stated_size_do_not_clog(emulated):
    rows = heaps(1.0)
    assert not any(r.outcome for r in rows)
    assert Bulk(emulated, rows).judged().verdict == "adequate"


def test_a_clog_that_the_base_model_expects_is_no_cause(emulated):
    large = Measurement(
        "heap", math.nan, math.nan, 4, {"particle_diameter_mm": 2.8}, outcome="clogged"
    )
    assert Bulk(emulated, [*heaps(1.0), large]).judged().verdict == "adequate"


def test_waves_and_the_runs_of_the_gain_fit_the_outcomes_that_the_verdict_fits(emulated):
    rows = heaps(1.3)
    read = [m for m in rows if not m.outcome]
    settings = emulated.settings
    bulk = Bulk(emulated, rows)
    found = bulk.judged(settings.alpha, settings.seed)
    verdict = findings(bulk, found, extension(bulk, found), settings.alpha)
    assert verdict["lack_of_fit"]["deviance"] > 1.0
    _, fitted = emulator_waves.modes(Bulk(emulated, rows))["size_bias"]
    model, own_fit = bulk.fit(["size_bias"])
    assert fitted.theta == pytest.approx(own_fit.theta)
    rig = Rig(settings, RUN, emulated.factors)
    planned, _ = extension_plan(rig, {"after": model}, read, bulk.data)
    strength = emulated.catalogue["size_bias"].strength
    # the angles alone leave the strength at its prior's 1.025
    assert all(strength.natural(r["theta"][-1]) > 1.1 for r in planned)
