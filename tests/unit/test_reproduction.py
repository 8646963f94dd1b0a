"""The reproduction table: every simulated item of the paper has a row, and each agreement follows
from the numbers."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from calibration.statistics.equivalence import (
    DIFFERENT,
    EQUIVALENT,
    UNDECIDABLE,
    UNDECIDED,
    compare,
)
from dem.io.files import write_json
from frozen import FROZEN
from paper.audit.paper import Paper
from paper.reproduction import rows as r
from paper.reproduction.study import Study as Kept
from paper.reproduction.table import ORDER, PAPER, counts, reproduce


@pytest.fixture(scope="module")
def study(tmp_path_factory, request):
    """A small study of the paper's own factors whose angles are the paper's, shifted by what a test
    asks for."""
    root = request.config.rootpath

    def make(shift=0.0, name="study"):
        folder, paper = tmp_path_factory.mktemp("made") / name, Paper(root / PAPER)
        names = [
            "salt_salt_rolling_friction",
            "salt_salt_restitution",
            "salt_steel_rolling_friction",
        ]
        coding = paper.numbers("table11_coding", "low", "high")
        region = [
            {"code": c, "name": n, "low": low, "high": high}
            for c, n, low, high in zip("GEC", names, coding["low"], coding["high"], strict=True)
        ]
        levels = paper.numbers("table11_box_behnken", "X", "Y", "Z", "angle_deg")
        runs = levels.rename(columns=dict(zip("XYZ", "GEC", strict=True)))
        for f in region:
            middle, half = 0.5 * (f["low"] + f["high"]), 0.5 * (f["high"] - f["low"])
            runs[f["name"]] = middle + half * runs[f["code"]]
        runs["response"] = runs["angle_deg"] + shift
        angles = paper.numbers("table13_validation", "angle_deg")["angle_deg"] + shift
        for stage in ("response_surface", "validation"):
            (folder / stage).mkdir(parents=True)
        runs.to_csv(folder / "response_surface" / "runs.csv", index=False)
        write_json(folder / "response_surface" / "region.json", region)
        measured = paper.angles()["angle_deg"]
        found = compare(angles, measured, 1.0)
        write_json(folder / "validation" / "validation.json", found)
        return folder

    return make


@pytest.fixture(scope="module")
def same(study, request):
    """(folder, table) of the paper's own numbers."""
    folder = study(name="salt")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(request.config.rootpath)
        return folder, reproduce([folder])


def test_every_item_has_a_row_and_the_counts_cover_all(same):
    _, table = same
    assert set(table["item"]) == set(ORDER) - {"Eq. 15"}  # of the scaling study, which has not run
    numbers = re.findall(r"\d+", counts(table))
    assert int(numbers[0]) == sum(map(int, numbers[1:])) == len(table)
    assert set(table["agreement"]) <= {
        EQUIVALENT, DIFFERENT, UNDECIDED, UNDECIDABLE, r.IN_TABLE, r.NOT_RUN, r.NOT_COMPARABLE,
        r.NO_NUMBER,
    }  # fmt: skip
    assert set(table.loc[table["item"] == "Table 7", "agreement"]) == {r.NOT_RUN}
    assert "not run" in counts(table)


def test_the_paper_s_own_numbers_agree_and_shifted_ones_do_not(repository, same, study):
    same = same[1].set_index("id")["agreement"]
    other = reproduce([study(6.0, "shifted")]).set_index("id")["agreement"]
    for name in ("eq28.Intercept", "table13.mean.salt", "eq28.A"):
        assert same[name] == EQUIVALENT, name
    # single runs that scatter by 0.955 on both sides do not show a difference to be below 1
    assert same["table11.whole"] == UNDECIDED
    for name in ("table11.whole", "eq28.Intercept", "optimum.angle"):
        assert other[name] == DIFFERENT, name
    assert same["table11.run1"] == other["table11.run1"] == r.IN_TABLE
    assert other["table13.mean.shifted"] == DIFFERENT
    assert other["validation.equivalence.shifted"] == DIFFERENT
    # a shift leaves the slopes
    assert other["eq28.A"] == EQUIVALENT


@pytest.mark.slow
def test_a_study_of_other_factors_is_not_compared_point_by_point(repository, study):
    folder = study()
    path = folder / "response_surface" / "region.json"
    region = json.loads(path.read_text())
    region[0]["name"] = "salt_steel_restitution"
    write_json(path, region)
    table = reproduce([folder])
    rows = table[table["item"] == "Table 10"]
    assert set(rows["agreement"]) == {r.NOT_COMPARABLE}
    assert "salt_steel_restitution" in rows["basis"].iloc[0]
    beside = reproduce([folder, study(name="beside")]).set_index("id")
    assert beside.loc["table11.whole", "agreement"] == UNDECIDED
    assert beside.loc["table11.run1", "study"] == "beside"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kept", "stage", "run", "rows"),
    [
        ("salt-slow", "screening", 2, {"table06.run2"}),
        ("salt-paper", "ascent", 3, {"table10.level3"}),
        # without it another run of the design alone decides a coefficient
        ("salt-paper", "response_surface", 5, {"table11.run5", "table12.R2_pred"}),
    ],
)
def test_a_run_without_a_value_is_a_row_without_a_number(
    repository, tmp_path, kept, stage, run, rows
):
    """A funnel that clogs costs its own row, and a degree of freedom of the effects."""
    before = reproduce([FROZEN / kept]).set_index("id")
    folder = tmp_path / kept
    shutil.copytree(FROZEN / kept, folder)
    runs = pd.read_csv(folder / stage / "runs.csv")
    runs.loc[runs["run"] == run, "response"] = np.nan
    runs.to_csv(folder / stage / "runs.csv", index=False)
    table = reproduce([folder]).set_index("id")
    assert set(table.index) == set(before.index)
    lost = table.index[(table["agreement"] == r.NO_NUMBER) & (before["agreement"] != r.NO_NUMBER)]
    assert set(lost) == rows
    assert "no value" in table.loc[min(rows), "basis"]
    judged = table.index.difference(lost)
    was, now = (t.loc[judged, "agreement"] == r.NOT_RUN for t in (before, table))
    assert (was == now).all()
    if stage == "screening":
        wide, narrow = (
            (t.loc["table07.G.effect", "high"] - t.loc["table07.G.effect", "low"])
            for t in (table, before)
        )
        assert wide > narrow


@pytest.mark.slow
def test_the_region_s_runs_at_other_seeds_count_together(repository, tmp_path):
    """Of the same region they narrow a coefficient; of another they say nothing of it."""
    own, more, else_where = (tmp_path / n for n in ("salt", "salt-9", "salt-8"))
    for folder in (own, more, else_where):
        shutil.copytree(FROZEN / "salt", folder)
    path = more / "response_surface" / "runs.csv"
    table = pd.read_csv(path)
    table.assign(response=table["response"] + 1.0).to_csv(path, index=False)
    path = else_where / "response_surface" / "region.json"
    region = json.loads(path.read_text())
    region[0]["low"] += 0.01
    path.write_text(json.dumps(region))
    study = Kept(own)
    study.repeats = (Kept(more), Kept(else_where))
    runs = study.region_runs()
    assert list(runs.groupby("replicate").size()) == [17, 17]
    alone, both = (
        reproduce([own], repeats=folders).set_index("id") for folders in ((), (more, else_where))
    )
    intercept = [float(t.loc["eq28.Intercept", "this_project"]) for t in (alone, both)]
    assert intercept[1] - intercept[0] == pytest.approx(0.5)
    # each repeat fitted alone: equal residuals, so equal statistics but for the mean in the CV
    r2 = [float(t.loc["table12.R2", "this_project"]) for t in (alone, both)]
    assert r2[0] == pytest.approx(r2[1])
    assert both.loc["table12.R2", "n"] == 2 * alone.loc["table12.R2", "n"]
    row = both.loc["table11.run1"]
    assert row["n"] == 2
    assert row["this_project"] - alone.loc["table11.run1", "this_project"] == pytest.approx(0.5)
