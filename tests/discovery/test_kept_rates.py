"""Rates of another engine or of other rules are not shown."""

import re
import shutil
from collections import Counter
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.rates import kept_rates, single_grains
from benchmarks.rates.__main__ import TRIALS
from calibration.digests import SOURCES

SHOWN = [name for name in TRIALS if name != "strangers_gains"]


@pytest.mark.parametrize("moved", ["engine", "rules", "neither"])
def test_a_row_of_another_engine_or_of_other_rules_is_not_fresh(moved):
    row = {"case": "x", "date": "2026-11-25", **kept_rates.present("contacts")}
    row |= {} if moved == "neither" else {moved: "0" * 12}
    rows = pd.DataFrame([row])
    assert len(kept_rates.fresh(rows, "contacts")) == (moved == "neither")


def test_the_rules_move_with_the_code_and_not_with_its_comments(tmp_path):
    def digest(name, file, change):
        copy = tmp_path / name
        shutil.copytree(SOURCES / "diagnosis", copy / "diagnosis")
        shutil.copytree(SOURCES / "calibration/inference", copy / "calibration/inference")
        file = copy / "diagnosis" / file
        file.write_text(change(file.read_text()))
        return kept_rates.rules("contacts", copy), kept_rates.rules("bulk", copy)

    now = tuple(kept_rates.present(of)["rules"] for of in ("contacts", "bulk"))
    model, waves = "table_model/selection.py", "emulator_waves.py"
    assert digest("comment", model, lambda text: f"{text}\n# nothing\n") == now
    moved = [
        digest(name, file, lambda text: f"{text}\nANOTHER = 1\n")
        for name, file in (("model", model), ("waves", waves), ("fits", "fit.py"))
    ]
    # a verdict on single contacts runs through no emulator
    changed = [tuple(a != b for a, b in zip(m, now, strict=True)) for m in moved]
    assert changed == [(True, True), (False, True), (True, True)]


@pytest.mark.parametrize("name", SHOWN)
def test_the_page_shows_the_kept_tables(name):
    assert TRIALS[name].shown() == TRIALS[name].kept_table()


def test_the_rates_that_the_evidence_tells_are_kept():
    told = re.findall(r"\d+ of \d+ \(\d+% to \d+%\)", Path("docs/evidence.md").read_text())
    assert len(told) > 10
    assert [rate for rate in told if rate not in kept_rates.PAGE.read_text()] == []


def test_a_trial_goes_on_and_begins_anew_under_other_rules(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_rates, "KEPT", tmp_path)
    asked, cases = [], [1, 2]

    def judged(case):
        asked.append(case)
        return {"case": f"c{case}", "hit": case % 2}

    def told(rows):
        return f"{kept_rates.share(rows['hit'])}"

    trial = kept_rates.Trial("odd", "bulk", lambda: cases, judged, told)
    trial.run()
    cases.append(3)
    trial.run()
    assert asked == [1, 2, 3]
    assert "\n(2, 3, 0.207" in trial.kept_table()  # Wilson's interval
    text = trial.kept.read_text()
    trial.kept.write_text(text.replace(kept_rates.present("bulk")["rules"], "0" * 12))
    assert trial.kept_table().startswith("No rates are shown")
    trial.run()
    assert asked == [1, 2, 3, 1, 2, 3]
    assert len(pd.read_csv(trial.kept)) == 3


def test_each_mechanism_is_planned_once_at_each_point_with_and_without_its_entry():
    cases = single_grains.planned()
    hidden = Counter((c.case, c.truth) for c in cases if c.truth)
    assert set(hidden.values()) == {single_grains.POINTS}
    assert {c.truth for c in cases if c.truth} == set(single_grains.strengths())
    assert len(set(cases)) == len(cases) == 84
