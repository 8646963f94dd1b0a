"""The diagnosis says of strangers' tables what is true of them.

Default: two of twenty tables, chosen with their seed before any verdict of theirs was seen. Slow:
the others, and every other kind once with the shares that are asked of many.
`python -m benchmarks.rates strangers` has the campaign.
"""

from functools import cache

import pandas as pd
import pytest
from scipy import stats

from benchmarks.rates.strangers import cases, score
from benchmarks.rates.strangers.campaign import diagnosed

VERDICTS = {"adequate", "identified", "discovered", "ambiguous", "error", "unexplained"}
ASKED = ("leads", "both", "silent", "pointed")
NEVER = ("adequate_wrongly", "wrong_name", "name_loses")
NAMED = ("seen after a slip", "air")
"""Kinds of FIXED whose mechanism must stand among the names."""


@cache
def of(case):
    """(marks, what is said) of a case."""
    return diagnosed(case)


def check(case):
    """What must be right of a fixed table. Raises AssertionError."""
    row, said = of(case)
    told = {k: v for k, v in row.items() if v is not None}
    assert said["verdict"] in VERDICTS, told
    assert all(row[k] in (None, 1) for k in ASKED), told
    assert not any(row[k] for k in NEVER), told
    assert case.kind not in NAMED or row["named"], told
    assert row["fault"] in (None, 1), told
    consistent(said)
    # an analysis of variance of the table, which knows neither the diagnosis nor what digits say
    rounded = "resolution" in [f.of for f in case.draw().faults]
    assert rounded or row["own_p"] > 1e-4 or said["misfit"]["p"] < 0.01, told
    if case.group in ("null", "two-level null"):
        assert said["verdict"] == "adequate", told
        assert said["family_p"] > 0.05, told  # chance gives the best law as much
    if case.group in ("two-level error", "two-level law"):
        assert said["verdict"] == "ambiguous", told
        assert said["next_measurement"], told
    if case.group == "level":
        assert level_of(case) in [e.get("level") for e in said["errors"]], told


def level_of(case):
    """The level in the table that was another one."""
    drawn = case.draw()
    [fault] = drawn.faults
    return float(drawn.table[fault.of].iloc[fault.lines[0] - 2])


def consistent(said):
    """The verdict is the one that its own content asks for."""
    verdict, laws, p = said["verdict"], said["laws"], said["misfit"]["p"]
    assert 0.0 <= p <= 1.0
    assert said["misfit"]["freedom"] > 0
    assert all({"experiment", "slot", "state", "names", "forms"} <= set(law) for law in laws)
    assert all({"experiment", "of", "sd", "p"} <= set(e) for e in said["errors"])
    assert all({"line", "standard_deviations"} <= set(r) for r in said["rows"])
    if verdict == "adequate":
        assert p >= 0.01
        assert not laws
    if verdict == "identified":
        assert laws
        assert all(len(law["names"]) == 1 for law in laws)
    if verdict == "discovered":
        assert laws
        # a form that fits as well as the one name is a formula of it, and no other cause
        assert any(len(law["names"]) != 1 for law in laws)
    if verdict == "error":
        assert not laws
        assert said["errors"] or said["rows"]


@pytest.mark.slow
@pytest.mark.parametrize("case", cases.FIXED, ids=lambda c: c.name)
def test_what_is_wrong_is_said(case):
    check(case)


@pytest.mark.long
@pytest.mark.slow
def test_every_kind_once():
    """Each share is what is asked, or not told from it by as many tables (5 %, one-sided)."""
    # no test goes by the speed of a machine; the campaign takes the seconds
    rows = pd.DataFrame([of(case)[0] for case in cases.MIDDLE]).assign(seconds=0.0)
    rows["strength"] = rows["strength"].replace(15.0, 10.0)
    rates = score.rates(rows).dropna(subset=["asked"])
    assert rates["of"].sum() > 100
    for r in rates[rates["of"] > 0].itertuples():
        side = "greater" if r.most else "less"
        asked = max(r.asked, 1e-3) if r.most else min(r.asked, 0.999)
        told = f"{r.figure}: {r.hits} of {r.of}\n{score.missed(rows)['case'].to_list()}"
        assert stats.binomtest(r.hits, r.of, asked, alternative=side).pvalue > 0.05, told
