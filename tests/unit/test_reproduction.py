"""The reproduction table: every item of the paper has a row, and each agreement follows from the numbers."""

import json
import re
import shutil

import pandas as pd
import pytest
import yaml

from calibration.config import parse_config
from calibration.errors import CalibrationError
from dem.io.files import write_json
from paper.audit.paper import Paper
from paper.reference import BEGIN, END, ascents, block, main
from paper.reproduction import counts, reproduce, write_reproduction
from paper.reproduction import rows as r
from paper.reproduction.table import ORDER, PAPER

PLACE = r.Place("Table 13", "t", "angle", "deg")


@pytest.fixture
def repository(monkeypatch, request):
    monkeypatch.chdir(request.config.rootpath)
    return request.config.rootpath


@pytest.fixture
def config(repository):
    return parse_config(yaml.safe_load((repository / "config" / "config.yaml").read_text()))


@pytest.fixture
def study(tmp_path):
    """A small study of the paper's own factors whose angles are the paper's, shifted by what a test asks for."""

    def make(shift=0.0, name="study"):
        folder, paper = tmp_path / name, Paper(PAPER)
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
        found = {"simulated_mean": angles.mean(), "simulated_sd": angles.std(), "simulated_n": 25}
        found |= {
            "measured_mean": 45.26,
            "difference": angles.mean() - 45.26,
            "margin": 1.0,
            "t_p": 0.5,
        }
        found |= {
            "difference_low": found["difference"] - 0.4,
            "difference_high": found["difference"] + 0.4,
        }
        write_json(folder / "validation" / "validation.json", found)
        return folder

    return make


def test_every_table_and_equation_has_a_row(config, study):
    table = reproduce([study()], config)
    items = set(table["item"])
    assert items - {"1.2"} == set(ORDER) - {"1.2"}
    assert {f"Table {n}" for n in range(1, 14)} <= items
    printed = Paper(PAPER).text("equations", "equation")["equation"]
    assert {f"Eq. {n}" for n in printed} <= items
    assert set(table["agreement"]) <= {
        r.AGREES, r.DISAGREES, r.NOT_RUN, r.NOT_COMPARABLE, r.NO_NUMBER, "undecided",
    }  # fmt: skip


def test_the_paper_s_own_numbers_agree_and_shifted_ones_do_not(config, study):
    same = reproduce([study()], config).set_index("id")["agreement"]
    other = reproduce([study(6.0, "shifted")], config).set_index("id")["agreement"]
    for name in ("table11.run1", "table11.whole", "eq28.Intercept", "table12.R2", "optimum.angle"):
        assert same[name] == r.AGREES, name
    for name in ("table11.run1", "table11.whole", "eq28.Intercept", "optimum.angle"):
        assert other[name] == r.DISAGREES, name
    assert same["table13.mean.study"] == r.AGREES
    assert other["table13.mean.shifted"] == r.DISAGREES
    assert same["eq28.A"] == other["eq28.A"] == r.AGREES  # a shift leaves the slopes


def test_a_study_of_other_factors_is_not_compared_point_by_point(config, study):
    folder = study()
    path = folder / "response_surface" / "region.json"
    region = json.loads(path.read_text())
    region[0]["name"] = "salt_steel_restitution"
    write_json(path, region)
    table = reproduce([folder], config)
    rows = table[table["item"] == "Table 10"]
    assert set(rows["agreement"]) == {r.NOT_COMPARABLE}
    assert "salt_steel_restitution" in rows["basis"].iloc[0]
    beside = reproduce([folder, study(name="beside")], config).set_index("id")
    assert beside.loc["table11.run1", "agreement"] == r.AGREES
    assert beside.loc["table11.run1", "study"] == "beside"


def test_what_has_not_run_says_so(config, study):
    table = reproduce([study()], config)
    assert set(table.loc[table["item"] == "Table 7", "agreement"]) == {r.NOT_RUN}
    assert "not run" in counts(table)


@pytest.mark.parametrize(("ours", "agreement"), [(45.9, r.AGREES), (47.5, r.DISAGREES)])
def test_means_agree_within_the_interval_of_their_difference(ours, agreement):
    row = r.means(PLACE, r.printed_of("45.55"), ours, 0.7, 25, 0.9, 25)
    assert row["agreement"] == agreement
    assert row["low"] < row["difference"] < row["high"]
    assert (row["low"] <= 0.005 and row["high"] >= -0.005) == (agreement == r.AGREES)


def test_more_scatter_makes_agreement_easier():
    for sd, agreement in ((0.1, r.DISAGREES), (2.0, r.AGREES)):
        assert r.single_run(PLACE, r.printed_of("45.0"), 47.0, sd, 25)["agreement"] == agreement
    assert (
        r.single_run(PLACE, r.printed_of("45.0"), 45.0, None, None)["agreement"] == r.NOT_COMPARABLE
    )


def test_printed_digits_carry_their_rounding():
    assert r.exact(PLACE, r.printed_of("1219"), 1219.49, "")["agreement"] == r.AGREES
    assert r.exact(PLACE, r.printed_of("1219"), 1219.51, "")["agreement"] == r.DISAGREES


def test_a_table_agrees_as_a_whole_with_as_many_misses_as_chance_allows():
    rows = [r.words(PLACE, "a", "a", "")] * 11
    assert r.overall(PLACE, rows + [r.words(PLACE, "a", "b", "")])["agreement"] == r.AGREES
    assert r.overall(PLACE, rows + [r.words(PLACE, "a", "b", "")] * 5)["agreement"] == r.DISAGREES
    assert r.overall(PLACE, [])["agreement"] == r.NOT_COMPARABLE


def test_the_readme_gets_the_rows_that_matter(config, study, tmp_path, monkeypatch):
    folder = study()
    table = reproduce([folder], config)
    with pytest.raises(CalibrationError, match="snakemake"):
        main(folder)
    write_reproduction(
        table, folder / "reproduction" / "reproduction.csv", folder / "reproduction" / "r.json"
    )
    (tmp_path / "README.md").write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    monkeypatch.chdir(tmp_path)
    main(folder)
    text = (tmp_path / "README.md").read_text()
    assert text.startswith("before\n")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text
    assert "| Table 13 | validated angle of repose [deg] | 45.55 | 45.5" in text
    (link,) = set(re.findall(r"\(([^)]*reproduction\.csv)\)", text))
    assert (tmp_path / link).is_file()
    shutil.rmtree(tmp_path / "results")
    kept = pd.read_csv(folder / "reproduction" / "reproduction.csv", dtype={"paper": str})
    assert block(kept, link) in text


def test_the_readme_shows_both_ascents(config, study, tmp_path):
    table = reproduce([study()], config)
    (tmp_path / "ascent").mkdir()
    assert ascents(tmp_path) is None
    (tmp_path / "ascent" / "ascent.json").write_text(json.dumps({"responses": [31.89, 38.83]}))

    def rows():
        text = block(table, "results/own/reproduction/reproduction.csv", ascents(tmp_path))
        return [line for line in text.splitlines() if line.startswith("| Table 10 |")]

    (row,) = rows()
    # as printed in Table 10, and ours
    assert "| 34.9, 43.6, 46.9, 50.2, 53.6 | 31.9, 38.8 | not comparable |" in row
    summary = table["headline"] & (table["item"] == "Table 10")
    table.loc[summary, ["agreement", "study"]] = [r.AGREES, "beside"]
    assert rows()[0] == row
    assert "all values, beside |" in rows()[1]
    # on the paper's own path each angle has its counterpart
    table.loc[summary, "study"] = "own"
    (compared,) = rows()
    assert "all values |" in compared
