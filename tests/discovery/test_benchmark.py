"""The benchmark's list of cases, how it goes on after an interruption, and the rates it reports."""

from collections import Counter
from types import SimpleNamespace

import pandas as pd
import pytest

from diagnosis.benchmark import study as benchmark
from diagnosis.benchmark.laboratory import Case, judge
from diagnosis.catalogue import load_catalogue
from diagnosis.settings import read_settings
from facts import rows_in

CONFIG = SimpleNamespace(run={}, factors="config/factors.tsv")


def found(verdict, causes, first):
    return SimpleNamespace(
        verdict=verdict,
        causes=causes,
        ranking=[{"mechanism": first, "gain": 5.0}],
        lack_of_fit_p=0.01,
        family_p=0.01,
    )


def test_every_mechanism_is_hidden_in_eight_draws_and_forty_are_null():
    cases = benchmark.cases()
    full = Counter(c.truth for c in cases if c.case == "mechanism" and c.strength == 1.0)
    assert set(full) == set(load_catalogue())
    assert min(full.values()) >= 8
    assert sum(c.case == "no effect" and c.bench == "grains" for c in cases) == 40
    assert len(set(cases)) == len(cases)
    assert not {c.point for c in cases} & {c.point for c in benchmark.cases(first=2000)}


def test_a_finished_case_is_kept_until_something_that_decides_it_changes(tmp_path, monkeypatch):
    asked = []

    class Fake:
        def diagnose(self, case):
            asked.append(case)
            return {"case": case.case, "seed": case.seed}

    monkeypatch.setattr(benchmark, "equip", lambda *_: Fake())
    plan = tmp_path / "plan.json"
    plan.write_text("{}")
    source = SimpleNamespace(plan=plan)
    settings = read_settings("config/discovery.yaml")
    some = benchmark.cases()[:4]
    run = [CONFIG, settings, source, tmp_path / "kept"]
    first = benchmark.run_cases(some[:3], *run)
    again = benchmark.run_cases(some, *run)
    assert asked == some  # the first three once only
    assert again[:3] == first
    plan.write_text('{"another": {}}')
    benchmark.run_cases(some, *run)
    assert len(asked) == 8


@pytest.mark.parametrize(
    ("verdict", "causes", "first", "named", "among", "outcome"),
    [
        ("identified", ["air_drag"], "air_drag", True, True, "air_drag"),
        ("identified", ["cohesion"], "cohesion", False, False, "cohesion"),
        ("ambiguous", ["air_drag", "cohesion"], "cohesion", False, True, "ambiguous"),
        ("adequate", [], "air_drag", False, False, "adequate"),
    ],
)
def test_a_verdict_is_compared_with_the_truth(verdict, causes, first, named, among, outcome):
    row = judge(Case("mechanism", ("air_drag",), 1.0, 100, 0), found(verdict, causes, first))
    assert (row["named_first"], row["among_causes"], row["outcome"]) == (named, among, outcome)


def test_rates_count_what_was_said(tmp_path):
    cases = [Case("no effect", (), 0.0, s, s) for s in range(4)]
    rows = [judge(c, found("adequate", [], "air_drag")) for c in cases[:3]]
    rows += [judge(cases[3], found("identified", ["air_drag"], "air_drag"))]
    hidden = Case("mechanism", ("air_drag",), 1.0, 100, 0)
    rows += [judge(hidden, found("identified", [m], m)) for m in ("air_drag", "cohesion")]
    rows = [r | {"hidden": "0.5 1", "size": 8.0} for r in rows]
    pd.DataFrame(rows).to_csv(tmp_path / "part.csv", index=False)
    names = {"cases": "csv", "confusion": "csv", "summary": "csv", "page": "md", "figure": "svg"}
    output = SimpleNamespace(**{n: tmp_path / f"{n}.{end}" for n, end in names.items()})
    benchmark.merge([tmp_path / "part.csv"], output)
    rates = pd.read_csv(output.summary).set_index("what")
    adequate, strong = "no effect, grains: adequate", "all mechanisms, strength 1: "
    assert rates.loc[adequate, "share"] == 0.75
    assert rates.loc[strong + "named first", "share"] == 0.5
    assert rates.loc[strong + "identified and wrong", "share"] == 0.5
    # Wilson's interval of 3 in 4, Agresti and Coull (1998)
    assert rates.loc[adequate, "low"] == pytest.approx(0.3006, abs=1e-3)
    confusion = pd.read_csv(output.confusion).set_index("hidden")
    assert confusion.loc["mechanism: air_drag", "cohesion"] == 1
    assert "<svg" in output.figure.read_text()
    rows = rows_in(output.page.read_text())
    assert rows[adequate] == ["3 of 4 (30% to 95%)", "95 %"]
    assert rows["air drag (grains)"] == ["0.5", "8.0", "1 of 2", "1 of 2", *2 * ["not run"]]
