"""Stein's two-stage rule: its interval covers as often as it states and is as narrow as asked; the
runs at the candidate follow it, with the seeds that a fixed number would have."""

import json
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy import stats

from calibration.chain.study import Study
from calibration.figures import response_of
from calibration.stages import optimum
from calibration.stages.optimum import (
    STAGES,
    _replicated,
    augmented_runs,
    plan_candidate,
    plan_candidate_first,
)
from calibration.stages.response_surface import plan_response_surface
from calibration.stages.screening import plan_screening
from calibration.stages.validation import plan_validation
from calibration.statistics.equivalence import mean_interval, runs_needed
from calibration.study.config import overlay, parse_config
from calibration.study.factors import read_factors
from dem.fingerprint import engine_fingerprint
from facts import ROOT, tells
from stage_files import Files, PlanFiles


def salt_of(*files, **own):
    """The salt's configuration with files of config/ and sections laid over it."""
    read = (yaml.safe_load(Path("config", file).read_text()) for file in ("config.yaml", *files))
    return parse_config(reduce(overlay, (*read, own)))


@pytest.fixture
def salt(repository):
    """The salt's study with the runs of the reference."""
    return salt_of("reference.yaml")


@pytest.fixture
def config(salt):
    """The salt's study with a rule of its own: 20 first runs, ±0.4°, at most 50."""
    rules = {"candidate_runs": 20, "candidate_half_width": 0.4, "candidate_at_most": 50}
    return salt.model_copy(update={"optimise": salt.optimise.model_copy(update=rules)})


@pytest.mark.parametrize(("sd", "at_most"), [(0.1, 10**9), (1.0, 10**9), (1.0, 30), (3.0, 30)])
def test_the_interval_covers_as_often_as_it_states_whatever_the_scatter(sd, at_most):
    rng, draws, first, half = np.random.default_rng(45), 10_000, 8, 0.5
    held, counts = 0, []
    for sample in rng.normal(45.0, sd, (draws, first)):
        count = runs_needed(sample, half, at_most)
        values = np.concatenate([sample, rng.normal(45.0, sd, count - first)])
        mean, reach = mean_interval(values, first)
        assert reach <= half or count == at_most
        held += abs(mean - 45.0) <= reach
        counts.append(count)
    assert 0.94 <= held / draws <= 0.96
    assert min(counts) >= first
    if at_most > draws:  # no fewer than a known scatter asks for
        assert np.mean(counts) >= (1.96 * sd / half) ** 2


def test_with_no_further_values_it_is_students_interval():
    values = np.random.default_rng(1).normal(45.0, 1.0, 12)
    mean, half = mean_interval(values, 12)
    low, high = stats.t.interval(0.95, 11, values.mean(), stats.sem(values))
    assert (mean - half, mean + half) == pytest.approx((low, high))


def test_values_without_scatter_ask_for_no_more():
    assert runs_needed(np.full(5, 45.0), 0.1, 100) == 5


@pytest.mark.parametrize(
    ("name", "part", "rig"),
    [("salt", "salt", ()), ("salt-printed", "printed rig", ("rigs/printed.yaml",))],
)
def test_the_reference_plans_the_kept_runs(name, part, rig, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    config, kept = salt_of("reference.yaml", *rig), ROOT / "results/reference" / name
    made = json.loads((kept.parent / "release.json").read_text())[part]["engine"]
    if made != engine_fingerprint():
        lists = {"numerics": {"skin": 0.05, "skin_horizon": 40}}  # defaults of its engine
        config = config.model_copy(update={"run": overlay(config.run, lists)})
    source = Files(ascent=kept / "ascent/ascent.json", optimum=kept / "optimise/optimum.json")
    stages = {"screening": plan_screening, "response_surface": plan_response_surface,
              "validation": plan_validation}  # fmt: skip
    for (stage, plan), seeds in zip(stages.items(), (0, 2, 4), strict=True):
        output = PlanFiles.of(tmp_path / stage)
        output = Files(**output._asdict(), region=tmp_path / stage / "region.json")
        plan(Study(config, seeds=seeds), source, output)
        runs = [pd.read_csv(file)["run_id"] for file in (output.design, kept / stage / "runs.csv")]
        assert list(runs[0]) == list(runs[1]), stage


def planned(config, folder, responses, monkeypatch, found):
    """Design and plan of all runs at the candidate, and the first ones' design, where these have
    `responses`."""
    monkeypatch.setattr(optimum, "with_responses", lambda t, _: t.assign(response=responses(t)))
    (folder / "optimum.json").write_text(json.dumps({"region": []} | found))
    study = Study(config, seeds=3)
    files = {name: PlanFiles.of(folder / name) for name in ("candidate_first", "candidate")}
    source = Files(optimum=folder / "optimum.json", first=files["candidate_first"].design)
    plan_candidate_first(study, source, files["candidate_first"])
    region = folder / "candidate" / "region.json"
    plan_candidate(study, source, Files(**files["candidate"]._asdict(), region=region))
    plan = json.loads(files["candidate"].plan.read_text())
    return pd.read_csv(files["candidate"].design), plan, pd.read_csv(source.first)


def scattering(sd, lost=0):
    """Responses (n,) of a design whose standard deviation is `sd`, the last ones missing."""

    def responses(design):
        n = len(design) - lost
        made = 45.0 + sd * stats.zscore(np.arange(n), ddof=1)
        return np.append(made, [np.nan] * lost)

    return responses


AT = {"salt_salt_rolling_friction": 0.27, "salt_salt_restitution": 0.5}


def test_the_scatter_of_the_first_runs_decides_how_many_are_added(config, tmp_path, monkeypatch):
    design, plan, first = planned(config, tmp_path, scattering(0.955), monkeypatch, {"optimum": AT})
    rules = config.optimise
    need = (stats.t.ppf(0.975, 19) * 0.955 / rules.candidate_half_width) ** 2
    assert (len(first), len(design)) == (20, int(np.ceil(need)))
    assert list(design["run_id"].head(20)) == list(first["run_id"])
    assert set(plan) == set(design["run_id"]) - set(first["run_id"])
    # the runs are those that a fixed number would have been
    fixed = Study(config, seeds=3).plan(pd.DataFrame([AT] * 50))[0]
    assert list(design["run_id"]) == list(fixed["run_id"].head(len(design)))
    assert list(design["seed"]) == list(range(3001, 3001 + len(design)))


def test_few_that_scatter_are_enough_and_many_are_no_more_than_allowed(
    config, tmp_path, monkeypatch
):
    design, plan, _ = planned(config, tmp_path, scattering(0.5), monkeypatch, {"optimum": AT})
    assert (len(design), plan) == (20, {})
    design, plan, _ = planned(config, tmp_path, scattering(9.0), monkeypatch, {"optimum": AT})
    assert (len(design), len(plan)) == (50, 30)


def test_a_run_without_a_value_is_made_up_for(config, tmp_path, monkeypatch):
    made = scattering(0.955, lost=2)
    design, _, _ = planned(config, tmp_path, made, monkeypatch, {"optimum": AT})
    need = (stats.t.ppf(0.975, 17) * 0.955 / config.optimise.candidate_half_width) ** 2
    assert len(design) == int(np.ceil(need)) + 2


def test_a_fixed_number_and_a_moved_region_ask_for_no_more(config, tmp_path, monkeypatch):
    rules = config.optimise.model_copy(update={"candidate_half_width": None})
    fixed = config.model_copy(update={"optimise": rules})
    repeat = {"optimum": AT, "repeat": [{n: v + 0.01 for n, v in AT.items()}]}
    design, plan, first = planned(fixed, tmp_path, scattering(9.0), monkeypatch, repeat)
    assert (len(design), len(first), plan) == (22, 22, {})


def test_without_runs_at_the_candidate_the_surface_has_its_own_alone(tmp_path, monkeypatch):
    """So the second solution is the first one; only what lies off the surface is run again."""
    monkeypatch.chdir(ROOT)
    config, responses = salt_of(optimise={"candidate_runs": 0}), scattering(0.7)
    design, plan, first = planned(config, tmp_path, responses, monkeypatch, {"optimum": AT})
    assert (len(design), len(first), plan) == (0, 0, {})
    runs = pd.DataFrame([AT, AT]).assign(response=[45.0, 46.0], E=0.0)
    runs.to_csv(tmp_path / "runs.csv", index=False)
    factors = [f for f in read_factors(config.factors) if f.name in AT]
    files = tmp_path / "runs.csv", factors, tmp_path / "candidate/design.csv"
    assert list(augmented_runs(config, *files)["response"]) == [45.0, 46.0]
    assert _replicated(config, files[2], list(AT)) == {}
    repeat = {"optimum": AT, "repeat": [AT]}
    assert len(planned(config, tmp_path, responses, monkeypatch, repeat)[0]) == 2


def test_the_interval_is_told_with_its_reason(config, tmp_path, monkeypatch):
    design, _, _ = planned(config, tmp_path, scattering(0.955), monkeypatch, {"optimum": AT})
    told = _replicated(config, tmp_path / "candidate/design.csv", list(AT))["candidate"]
    values = scattering(0.955)(design)
    assert told["mean"] == pytest.approx(values.mean())
    assert told["runs"] == len(design)
    assert (told["first_runs"], told["half_width_asked"]) == (20, 0.4)
    half = stats.t.ppf(0.975, 19) * values[:20].std(ddof=1) / np.sqrt(len(values))
    assert told["half_width_95"] == pytest.approx(half)
    text = STAGES[0].sentences(
        {"candidate": told, "optimum": AT}, response_of("angle_of_repose_deg")
    )
    assert "Stein's rule" in " ".join(text)
    wide = STAGES[0].sentences(
        {"candidate": told | {"half_width_95": 0.5}, "optimum": AT},
        response_of("angle_of_repose_deg"),
    )
    assert tells(" ".join(wide), "more runs", "0.4")
