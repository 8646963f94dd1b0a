"""Designs for screening and surfaces have the properties that define them."""

import json
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration.chain.study import Study
from calibration.errors import CalibrationError
from calibration.figures import ANGLE
from calibration.stages.ascent import ascent, plan_ascent
from calibration.stages.screening import STAGES, plan_screening, screening
from calibration.statistics.design import (
    alias_groups,
    box_behnken,
    central_composite,
    path_from_effects,
    plackett_burman,
    resolution_iv,
    screening_design,
    steepest_path,
)
from calibration.statistics.surface import model_matrix, quadratic_terms
from calibration.study.config import parse_config
from calibration.study.config.schema import ScreeningConfig
from calibration.study.factors import Factor, read_factors
from facts import ROOT, refused, tells
from paper_tables import paper_table
from stage_files import PlanFiles, write


def factors(k):
    return [Factor(chr(65 + i), f"f{i}", f"k{i}", 10.0, 14.0) for i in range(k)]


def coded(table, k):
    return table[[f.code for f in factors(k)]].to_numpy()


@pytest.mark.parametrize("k", range(1, 24))
def test_main_effects_are_clear_of_two_factor_interactions(k):
    x = coded(resolution_iv(factors(k)), k)
    assert set(np.unique(x)) == {-1.0, 1.0}
    assert len(x) == {1: 4, 2: 4, 3: 8}.get(k, 2 ** int(np.ceil(np.log2(2 * k))))
    pairs = [x[:, i] * x[:, j] for i, j in combinations(range(k), 2)]
    assert np.array_equal(x.T @ x, len(x) * np.eye(k))
    for column in [np.ones(len(x)), *pairs]:
        assert not (x.T @ column).any()


def test_the_sixteen_runs_of_seven_factors_have_the_published_generators_and_words():
    """E = ABC, F = BCD, G = ACD; defining words ABCE, BCDF, ACDG, ADEF, BDEG, ABFG, CEFG
    (Montgomery, Design and Analysis of Experiments, 8th edition, example 8.6 and table X(i)), which
    alias the 21 pairs in seven threes."""
    table = resolution_iv(factors(7))
    x = dict(zip("ABCDEFG", coded(table, 7).T, strict=True))
    for word in ("ABCE", "BCDF", "ACDG", "ADEF", "BDEG", "ABFG", "CEFG"):
        assert np.prod([x[c] for c in word], axis=0).min() == 1.0
    groups = alias_groups(coded(table, 7), list("ABCDEFG"))
    assert sorted(map(len, groups)) == [3] * 7
    assert [("A", "B"), ("C", "E"), ("F", "G")] in groups


def _screened(monkeypatch, folder, response):
    """(study, summary) of the paper's screening and its foldover with response(table)."""
    monkeypatch.chdir(ROOT)
    data = yaml.safe_load(Path("config/config.yaml").read_text())
    data["screening"]["foldover"] = True
    study = Study(parse_config(data))
    plan_screening(study, None, PlanFiles.of(folder))
    names = "runs effects anova half_normal pareto summary"
    output = SimpleNamespace(further={}, **{n: folder / f"{n}.svg" for n in names.split()})
    monkeypatch.setattr(
        "calibration.chain.responses.with_responses",
        lambda table, _: table.assign(response=response(table)),
    )
    monkeypatch.setattr("calibration.chain.responses.reason_without", lambda name: "it clogged")
    screening(study, SimpleNamespace(design=folder / "design.csv"), output)
    return json.loads(output.summary.read_text())


def test_a_folded_screening_tells_both_halves(tmp_path, monkeypatch):
    noise = np.random.default_rng(3)

    def response(table):  # an effect of 16 of G, and an interaction
        return 40 + 8 * table["G"] + 2 * table["A"] * table["G"] + noise.normal(0, 0.3, len(table))

    summary = _screened(monkeypatch, tmp_path, response)
    folded = summary["with_foldover"]
    assert {"AG", "BD", "CE"} in [set(g.split(" = ")) for g in summary["aliased"]]
    assert (folded["runs"], folded["aliased"], set(map(len, folded["aliases"].values()))) == (
        24, [], {0},
    )  # fmt: skip
    # the interaction leans on the effects of B to F in the paper's half alone
    g, c = "salt_salt_rolling_friction", "salt_steel_rolling_friction"
    assert folded["effects"][g] == pytest.approx(16.0, abs=0.5)
    assert abs(summary["effects"][c]) > 1.0 > 2 * abs(folded["effects"][c])
    assert tells(" ".join(STAGES[0].sentences(summary, ANGLE)), "foldover", "24 runs")


def test_both_halves_decide_where_the_table_s_runs_that_are_left_cannot(tmp_path, monkeypatch):
    """Grains that neither slide nor roll clog an opened funnel: the runs with F and G at their
    greatest, three of the table's twelve and three of its foldover's, have no value. The nine left
    do not tell seven factors apart; the eighteen of both halves do."""
    effects = dict(zip("ABCDEFG", (-1.4, 0.0, 2.9, 0.5, -2.5, 3.9, 16.0), strict=True))
    noise = np.random.default_rng(5)

    def response(table):
        y = 40 + sum(effect / 2 * table[code] for code, effect in effects.items())
        y += noise.normal(0, 0.2, len(table))
        return y.mask((table["F"] > 0) & (table["G"] > 0))

    summary = _screened(monkeypatch, tmp_path, response)
    assert len(summary["left_out"]) == 6
    assert summary["halves"] == {"runs": 18}
    assert "with_foldover" not in summary
    assert list(summary["effects"].values()) == pytest.approx(list(effects.values()), abs=0.4)
    assert {"salt_salt_rolling_friction", "salt_salt_static_friction"} <= set(
        summary["significant"]
    )
    said = " ".join(STAGES[0].sentences(summary, ANGLE))
    assert tells(said, "foldover", "18 runs", "both halves")


@pytest.mark.parametrize("k", range(1, 7))
def test_a_central_composite_design_fits_the_quadratic_model(k):
    table = central_composite(factors(k), centre_runs=4)
    assert len(table) == 2**k + 2 * k + 4
    codes = [f.code for f in factors(k)]
    matrix = model_matrix(coded(table, k), codes, quadratic_terms(codes))
    assert np.linalg.matrix_rank(matrix) == matrix.shape[1]
    assert np.abs(coded(table, k)).max() == 1.0


def test_what_no_design_takes_is_said():
    for k in (0, 24):
        with refused(CalibrationError, "1 to 23", str(k)):
            screening_design(factors(k), ScreeningConfig())


@pytest.mark.parametrize(
    ("k", "runs"),
    [(4, 12), (7, 12), (8, 12), (11, 12), (12, 16), (15, 16), (16, 20), (20, 24), (23, 24)],
)
def test_screening_takes_the_smallest_design_of_twelve_or_more(k, runs):
    x = np.column_stack([np.ones(runs), coded(plackett_burman(factors(k)), k)])
    assert np.array_equal(x.T @ x, runs * np.eye(k + 1))


def test_more_runs_can_be_asked_for():
    assert len(plackett_burman(factors(7), runs=20)) == 20
    with refused(CalibrationError, "28 runs", "7 factors"):
        plackett_burman(factors(7), runs=28)


def test_natural_levels_stand_beside_coded_ones():
    table = plackett_burman(factors(4), replicates=3)
    assert list(table["run"]) == list(range(1, 37))
    assert list(table["replicate"].unique()) == [1, 2, 3]
    for f in factors(4):
        assert table[f.name].to_numpy() == pytest.approx(f.centre + 2.0 * table[f.code].to_numpy())
        assert f.coded(table[f.name]).to_numpy() == pytest.approx(table[f.code].to_numpy())


def test_shipped_factors_are_table_5():
    printed = paper_table("table05_contact_parameter_ranges")
    factors = read_factors(ROOT / "config" / "factors.tsv")
    found = [(f.code, f.name, f.low, f.high) for f in factors]
    assert found == [tuple(row) for row in printed.itertuples(index=False)]


@pytest.mark.parametrize("k", range(3, 8))
def test_a_box_behnken_design_estimates_the_quadratic_model(k):
    table = box_behnken(factors(k), centre_runs=5)
    x = coded(table, k)
    terms = quadratic_terms([f.code for f in factors(k)])
    matrix = model_matrix(x, [f.code for f in factors(k)], terms)
    assert np.linalg.matrix_rank(matrix) == len(terms)
    # main effects and interactions are orthogonal to each other and to all the rest
    gram = matrix.T @ matrix
    crossed = [i for i, t in enumerate(terms) if len(set(t)) == len(t) > 0]
    off = gram[crossed] - np.diag(np.diag(gram))[crossed]
    assert not off.any()
    # never a corner, and every factor equally often at either level
    assert np.abs(x).sum(axis=1).max() < k
    assert len(set((x == 1).sum(axis=0)) | set((x == -1).sum(axis=0))) == 1
    assert (np.abs(x).sum(axis=1) == 0).sum() == 5


def test_the_papers_second_design_is_a_box_behnken_design():
    printed = paper_table("table11_box_behnken")[["X", "Y", "Z"]].to_numpy()
    ours = coded(box_behnken(factors(3), centre_runs=5), 3)
    assert sorted(map(tuple, printed)) == sorted(map(tuple, ours))


def test_table_10_from_its_start_and_steps():
    path = paper_table("table10_steepest_ascent")
    table_5 = {f.code: f for f in read_factors(ROOT / "config" / "factors.tsv")}
    chosen = [table_5[c] for c in "GEC"]
    start = dict(zip((f.name for f in chosen), (0.11, 0.75, 0.26), strict=True))
    step = dict(zip((f.name for f in chosen), (0.06, -0.15, 0.06), strict=True))
    table = steepest_path(chosen, start, step, 5)
    for f, column in zip(chosen, "XYZ", strict=True):
        assert table[f.name].to_numpy() == pytest.approx(path[column].to_numpy())
    with refused(CalibrationError, "6", "salt_salt_rolling_friction"):
        steepest_path(chosen, start, step, 6)


def test_the_path_of_the_effects_is_the_gradient_in_coded_levels():
    chosen = factors(3)
    effects = {"A": 4.0, "B": -2.0, "C": 1.0}
    start, step = path_from_effects(chosen, effects, 5)
    table = steepest_path(chosen, start, step, 5)
    x = coded(table, 3)
    assert np.diff(x, axis=0) == pytest.approx(np.tile([0.5, -0.25, 0.125], (4, 1)))
    assert x.mean(axis=0) == pytest.approx(np.zeros(3))
    assert np.abs(x).max() == 1.0
    # no direction of the same length climbs a plane with these effects faster
    slope = np.array([2.0, -1.0, 0.5])
    way = x[-1] - x[0]
    assert slope @ way == pytest.approx(np.linalg.norm(slope) * np.linalg.norm(way))


def test_the_mean_of_a_point_decides_along_a_path_that_is_run_several_times(tmp_path, monkeypatch):
    """The second point's first run gives the measured value by chance, the third's on average."""
    data = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    data["ascent"]["replicates"] = 2
    monkeypatch.chdir(ROOT)
    study = Study(parse_config(data))
    names = ["salt_steel_rolling_friction", "salt_salt_restitution", "salt_salt_rolling_friction"]
    summary = {"factors": names, "effects": dict.fromkeys(study.config.fixed, 1.0)}
    write(tmp_path / "screening.json", summary)
    plan_ascent(
        study, SimpleNamespace(screening=tmp_path / "screening.json"), PlanFiles.of(tmp_path)
    )
    design = pd.read_csv(tmp_path / "design.csv")
    points = [t[names].to_numpy().tolist() for _, t in design.groupby("replicate")]
    assert points[0] == points[1]
    assert len(points[0]) == 5
    assert design["run_id"].is_unique
    above = np.array([-9.0, 0.0, 3.0, 6.0, 9.0, -9.0, -5.0, -3.0, 6.0, 9.0])  # the measured value
    measured = float(np.mean(study.measured()))
    monkeypatch.setattr(
        "calibration.chain.responses.with_responses",
        lambda table, _: table.assign(response=measured + above),
    )
    files = {n: tmp_path / f"{n}.svg" for n in ("runs", "path", "summary")}
    ascent(study, SimpleNamespace(design=tmp_path / "design.csv"), SimpleNamespace(**files))
    found = json.loads(files["summary"].read_text())
    assert found["step"] == 3
    assert [found["centre"][name] for name in names] == pytest.approx(points[0][2])
    assert found["responses"] == pytest.approx(measured + np.array([-9.0, -2.5, 0.0, 6.0, 9.0]))
