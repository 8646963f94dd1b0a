"""A changed engine is accepted by margins: what is within them, what is not shown to be apart, and
what is refused."""

import subprocess

import numpy as np
import pytest
from scipy import stats

from dem.benchmark.acceptance import command, runs
from dem.benchmark.acceptance.judge import ALIKE, DIFFERENT, SAME, UNKNOWN, judge
from dem.benchmark.acceptance.trials import TRIALS
from dem.cli import main
from dem.errors import DemError
from dem.experiments import experiments
from dem.spec import parse_spec
from facts import refused


def pairs(shift, sd, seed, n=20):
    rng = np.random.default_rng(seed)
    old = 30.0 + rng.normal(0.0, sd, n)
    return old, old + shift + rng.normal(0.0, sd, n)


def test_the_interval_is_student_s_of_the_pairs():
    old, new = pairs(0.3, 1.0, 1)
    found = judge(old, new, 0.1, False, 1)
    low, high = stats.ttest_rel(new, old).confidence_interval(0.95)
    assert found.difference - found.half == pytest.approx(low)
    assert found.difference + found.half == pytest.approx(high)
    assert judge(old, new, 0.1, False, 7).half > found.half


@pytest.mark.parametrize(
    ("shift", "sd", "outcome"),
    [(0.02, 0.01, SAME), (0.0, 1.0, ALIKE), (0.3, 0.05, DIFFERENT), (-0.3, 0.05, DIFFERENT)],
)
def test_a_difference_is_judged_by_its_interval_and_the_margin(shift, sd, outcome):
    found = judge(*pairs(shift, sd, 2), 0.1, False, 1)
    assert found.outcome == outcome
    assert found.accepted == (outcome != DIFFERENT)


def test_chance_refuses_as_seldom_as_said_and_a_shift_is_refused():
    refused = [judge(*pairs(0.0, 1.0, s), 0.0, False, 1).accepted for s in range(400)]
    assert 0.02 < 1.0 - np.mean(refused) < 0.085  # 5 %, margin 0
    assert not any(judge(*pairs(2.5, 1.0, s), 0.1, False, 7).accepted for s in range(50))


def test_a_relative_margin_is_a_share_of_the_old_mean():
    found = judge([100.0, 102.0, 98.0], [100.4, 102.4, 98.4], 0.005, True, 1)
    assert found.margin == pytest.approx(0.5)
    assert found.outcome == SAME


def test_runs_that_one_engine_alone_loses_refuse_it():
    old, new = pairs(0.0, 0.01, 3)
    new[:9] = np.nan
    found = judge(old, new, 0.1, False, 1)
    assert found.lost == (0, 9)
    assert found.outcome == DIFFERENT
    new[1:] = np.nan
    assert judge(old, new, 0.1, False, 1).outcome == UNKNOWN


def test_every_trial_is_a_valid_run_and_names_a_metric():
    for trial in TRIALS:
        spec = parse_spec(trial.spec(3))
        assert spec.seed == 3
        experiments()[spec.experiment].check(spec)
        assert trial.metric in {m.name for m in experiments()[spec.experiment].metrics}


def test_what_is_no_engine_is_told(tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    with refused(DemError, "src/dem"):
        runs.checkout(tmp_path / "empty", tmp_path)
    monkeypatch.chdir(tmp_path)
    subprocess.run(["git", "init", "-q"], check=True)
    with refused(DemError, "no-such-revision"):
        runs.checkout("no-such-revision", tmp_path)


class Double:
    """An engine whose values are drawn; those of `shifted` are a tenth higher."""

    def __init__(self, given, out):
        self.given, self.asked = given, []

    def fingerprint(self):
        return self.given * 8

    def ask(self, name, spec, metric):
        self.asked.append((name, spec["seed"]))

    def answer(self):
        name, seed = self.asked.pop(0)
        value = 10.0 + np.random.default_rng([seed, len(name)]).random()
        return {"value": value * (1.1 if self.given == "shifted" else 1.0), "seconds": 1.0}

    def close(self):
        pass


def test_the_command_ends_with_a_table_and_its_verdict(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "Engine", Double)
    monkeypatch.setattr(command, "closed_forms", lambda *_: (True, "3 passed"))
    out = ["--out", str(tmp_path), "--seeds", "4"]
    assert main(["accept", "same", "like", *out]) == 0
    said = capsys.readouterr().out
    assert all(trial.name in said for trial in TRIALS)
    assert said.splitlines()[-1] == "accepted"
    with pytest.raises(SystemExit) as ended:
        main(["accept", "same", "shifted", *out])
    assert ended.value.code == 1
    assert "REFUSED" in capsys.readouterr().out
    monkeypatch.setattr(command, "closed_forms", lambda *_: (False, "FAILED test_drag"))
    with pytest.raises(SystemExit):
        main(["accept", "same", "like", *out])
    assert main(["accept", "same", "like", "--seeds", "1"]) == 2
