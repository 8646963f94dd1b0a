"""Draws of the posterior in another machine: its intervals hold what they say, and the parts of its
scatter are told apart."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from calibration.chain.study import Study
from calibration.figures import ANGLE
from calibration.runs.plans import read_plan
from calibration.stages.push_through import STAGES, nested
from facts import tells
from made_up import HEAP, READINGS, answer, made_up
from workflow_rules import rules_of

KEYS = {
    "rolling": "contacts.particle_particle.rolling_friction",
    "restitution": "contacts.particle_particle.restitution",
    "wall": "contacts.particle_wall.static_friction",
}
MACHINE = {"experiment": "tilt", "metrics": ["sliding_angle_deg"]}


def draws_of(n, r, between, within, rng):
    """Values (n r,) about 10 at n draws, r at each, and the draws' numbers."""
    value = np.repeat(10.0 + rng.normal(0.0, between, n), r) + rng.normal(0.0, within, n * r)
    return value, np.repeat(np.arange(n), r)


def test_the_two_scatters_are_those_of_the_analysis_of_variance():
    """Box, Hunter and Hunter (2005), Statistics for Experimenters, 2nd ed., chapter 9, treat the
    same table; here the closed form: mean squares between b and within w of r runs give
    sqrt((b - w) / r) and sqrt(w)."""
    value, of = draws_of(9, 4, 2.0, 1.0, np.random.default_rng(1))
    table = value.reshape(9, 4)
    w = table.var(axis=1, ddof=1).mean()
    b = 4 * table.mean(axis=1).var(ddof=1)
    found = nested(value, of)
    assert found["sd_parameters"] == pytest.approx(np.sqrt((b - w) / 4))
    assert found["sd_seed"] == pytest.approx(np.sqrt(w))
    f, _ = stats.f_oneway(*table)
    assert b / w == pytest.approx(f)


@pytest.mark.slow
@pytest.mark.parametrize(("r", "between", "within"), [(1, 1.0, 0.5), (2, 1.0, 1.0), (3, 0.2, 1.0)])
def test_the_interval_holds_a_further_run_as_often_as_it_says(r, between, within):
    """95 % means 94 to 96, over 4000 studies of 12 draws each with a further run of its own."""
    rng, inside, studies = np.random.default_rng(2), 0, 4000
    for _ in range(studies):
        found = nested(*draws_of(12, r, between, within, rng))
        new = 10.0 + rng.normal(0.0, between) + rng.normal(0.0, within)
        inside += found["low"] <= new <= found["high"]
    assert 0.94 <= inside / studies <= 0.96


MEASURED = READINGS + "tilt,sliding_angle,19,deg\ntilt,sliding_angle,21,deg\n"


def config_of(tmp_path, monkeypatch, draws=12, replicates=3):
    return made_up(
        tmp_path, monkeypatch, KEYS, MEASURED, seed=7, fixed={"wall": 0.33},
        tests={"heap": {"experiment": "heap", "run": HEAP}, "chute": MACHINE},
        predict={"draws": draws, "replicates": replicates},
    )  # fmt: skip


def pushed(config, formula):
    """The stage as the workflow calls it, on 60 draws of two parameters; returns its summary."""
    study = Study(config)
    rng = np.random.default_rng(4)
    draws = pd.DataFrame({"rolling": 0.2 + 0.1 * rng.random(60), "restitution": rng.random(60)})
    folder = study.folder / "posterior"
    folder.mkdir(parents=True)
    draws.assign(predicted=40.0).to_csv(folder / "draws.csv", index=False)
    rules = rules_of(config.model_dump(mode="json"))
    rules["plan_push_through"].call(study)
    answer(study.folder / "push_through" / "plan.json", formula)
    rules["push_through"].call(study)
    return study.summary("push_through")


def slides(spec, rng):
    rolling = spec["contacts"]["particle_particle"]["rolling_friction"]
    return {"sliding_angle_deg": 10.0 + 40.0 * rolling + 0.2 * rng.standard_normal()}


def test_another_machine_is_run_with_the_draws(tmp_path, monkeypatch):
    """40 degrees a unit of a parameter that is uniform over 0.1: 1.15 degrees from draw to draw."""
    config = config_of(tmp_path, monkeypatch)
    (row,) = pushed(config, slides)["metrics"]
    specs = list(read_plan("results/made-up/push_through/plan.json").values())
    assert len(specs) == 36
    assert {s["experiment"] for s in specs} == {"tilt"}
    assert {s["contacts"]["particle_wall"]["static_friction"] for s in specs} == {0.33}
    assert len({s["seed"] for s in specs}) == 36
    assert min(s["seed"] for s in specs) == 7 + 5000
    assert "count" not in specs[0].get("particles", {})  # the heap's grains are not the machine's
    assert row["mean"] == pytest.approx(20.0, abs=0.8)
    assert row["sd_parameters"] == pytest.approx(40.0 * 0.1 / np.sqrt(12.0), rel=0.4)
    assert row["sd_seed"] == pytest.approx(0.2, rel=0.4)
    assert row["decides"] == "rolling"
    assert row["rank_correlation"] > 0.9
    assert row["measured"] == pytest.approx(20.0)
    assert row["within"]
    (said,) = STAGES[0].sentences({"metrics": [row]}, ANGLE)
    assert said.startswith("chute: sliding angle 20.")
    assert tells(said, "Rolling", "rank correlation")
    assert "Measured: 20.00°, inside it." in said
    table = pd.read_csv("results/made-up/push_through/metrics.csv")
    assert table.loc[0, "low"] == pytest.approx(row["low"])
    assert "<path" in Path("results/made-up/push_through/push_through.svg").read_text()


def test_runs_without_a_value_are_counted_and_too_few_said(tmp_path, monkeypatch):
    config = config_of(tmp_path, monkeypatch, draws=4, replicates=1)
    counted = iter(range(4))

    def some(spec, rng):
        return slides(spec, rng) if next(counted) < 2 else {}

    (row,) = pushed(config, some)["metrics"]
    assert (row["runs"], row["without"], row["low"]) == (2, 2, None)
    assert tells(STAGES[0].sentences({"metrics": [row]}, ANGLE)[0], "2 of 4", "runs")
    assert json.loads(Path("results/made-up/push_through/push_through.json").read_text())
