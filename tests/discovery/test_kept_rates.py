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
    row = {"case": "x", "date": "2026-11-25", **kept_rates.present()}
    row |= {} if moved == "neither" else {moved: "0" * 12}
    rows = pd.DataFrame([row])
    assert len(kept_rates.fresh(rows)) == (moved == "neither")


def test_the_rules_move_with_the_code_and_not_with_its_comments(tmp_path):
    def digest(name, file, change):
        copy = tmp_path / name
        shutil.copytree(SOURCES / "diagnosis", copy / "diagnosis")
        shutil.copytree(SOURCES / "calibration/inference", copy / "calibration/inference")
        file = copy / "diagnosis" / file
        file.write_text(change(file.read_text()))
        return kept_rates.rules(copy, "contacts"), kept_rates.rules(copy, "bulk")

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


def test_a_trial_goes_on_and_leaves_rows_of_other_rules_out(tmp_path):
    asked = []

    def judged(case):
        asked.append(case)
        return {"case": f"c{case}", "hit": case % 2}

    cases, path = [1, 2, 3], tmp_path / "odd.csv"
    trial = kept_rates.Trial(
        "odd", "bulk", lambda: cases, judged, lambda rows: f"{kept_rates.share(rows['hit'])}",
        lambda c: {"case": f"c{c}"}, tmp_path,
    )  # fmt: skip
    trial.run(2)
    trial.run()
    assert asked == [1, 2, 3]
    assert "\n(2, 3, 0.207" in trial.kept_table()  # Wilson's interval
    path.write_text(path.read_text().replace(kept_rates.present("bulk")["rules"], "0" * 12, 1))
    trial.run()
    assert asked == [1, 2, 3, 1]
    assert len(kept_rates.kept(path, "bulk")) == len(pd.read_csv(path)) == 3


def test_each_mechanism_is_planned_once_at_each_point_with_and_without_its_entry():
    cases = single_grains.planned()
    hidden = Counter((c.case, c.truth) for c in cases if c.truth)
    assert set(hidden.values()) == {single_grains.POINTS}
    assert {c.truth for c in cases if c.truth} == set(single_grains.strengths())
    assert len(set(cases)) == len(cases) == 84
