"""The region of the response surface: physical limits, a target outside it, outliers and runs
without a response; its solution set is whole, and the chosen point obeys its rule."""

import json
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration.chain.study import Study
from calibration.figures import ANGLE
from calibration.runs import progress
from calibration.stages.optimum import _moved, plan_candidate, plan_candidate_first
from calibration.stages.response_surface import STAGES, plan_response_surface, response_surface
from calibration.statistics import surface as surfaces
from calibration.statistics.design import (
    box_behnken,
    central_composite,
    region_design,
    resolution_iv,
)
from calibration.statistics.optimise import solve
from calibration.statistics.screening import PURE_ERROR, interactions, screen
from calibration.statistics.surface import (
    fit_surface,
    model_matrix,
    outlier_limit,
    outliers,
    parameter_interval,
    quadratic_terms,
    reduced_surface,
)
from calibration.study.config import parse_config
from calibration.study.config.schema import SurfaceConfig
from calibration.study.factors import inside, physical_range, read_factors
from facts import tells
from made_up import factors
from stage_files import Files, PlanFiles, write
from workflow_rules import ROOT, rules_of


def noisy(design, codes, sd=0.3, seed=1):
    rng = np.random.default_rng(seed)
    y = 40.0 + 3.0 * design[codes[0]] - 2.0 * design[codes[0]] ** 2
    return y.to_numpy() + rng.normal(0.0, sd, len(design))


def test_a_region_moves_inside_what_is_possible():
    # a face at 1.08 for a restitution whose best level was 0.95
    assert inside(0.95, 0.13, 0.03, 1.0) == pytest.approx((0.87, 0.13))
    assert inside(0.5, 0.13, 0.03, 1.0) == (0.5, 0.13)
    centre, half = inside(0.95, 2.0, 0.0, 1.0)
    assert (centre - half, centre + half) == pytest.approx((0.0, 1.0))


@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_surface_takes_any_number_of_factors_from_one(k):
    design = region_design(factors(k), SurfaceConfig(centre_runs=4))
    codes = [f.code for f in factors(k)]
    surface = fit_surface(design, codes, noisy(design, codes))
    assert surface.predict([np.zeros(k)])[0] == pytest.approx(40.0, abs=0.6)


def test_an_outlier_is_named_and_not_dropped():
    design, codes = box_behnken(factors(3), 5), list("ABC")
    y = noisy(design, codes)
    clean = fit_surface(design, codes, y)
    assert not len(outliers(clean))
    y[14] += 3.0
    surface = fit_surface(design, codes, y)
    assert list(outliers(surface)) == [14]
    assert len(surface.diagnostics) == 17


@pytest.mark.slow
def test_clean_designs_have_outliers_as_often_as_stated():
    design, codes = central_composite(factors(2), 5), list("AB")
    rng = np.random.default_rng(5)
    found = [
        len(outliers(fit_surface(design, codes, rng.normal(size=len(design))), 0.05)) > 0
        for _ in range(600)
    ]
    assert np.mean(found) <= 0.075  # 5 %, and three standard errors
    assert outlier_limit(fit_surface(design, codes, rng.normal(size=len(design)))) > 3.0


def test_reduction_keeps_the_factor_of_a_term_that_stays():
    design, codes = box_behnken(factors(3), 5), list("ABC")
    rng = np.random.default_rng(2)
    y = 5.0 + 2.0 * design["A"] * design["B"] + 1.5 * design["C"] ** 2
    reduced = reduced_surface(design, codes, y + 0.2 * rng.normal(size=len(design)))
    terms = set(reduced.terms)
    assert {("A", "B"), ("C", "C"), ("A",), ("B",), ("C",)} <= terms
    assert len(terms) < 10


def test_the_scatter_of_seeds_holds_no_aliased_interaction():
    design = resolution_iv(factors(7), centre_runs=4)
    rng, codes = np.random.default_rng(4), list("ABCDEFG")
    y = 30 + 2 * design["A"] + 6 * design["B"] * design["C"] + rng.normal(0, 0.3, len(design))
    found = screen(design, codes, y)
    assert found.seed_sd == pytest.approx(0.3, rel=0.8)
    assert found.method == PURE_ERROR
    assert found.table["p"].to_numpy() == pytest.approx(found.table["p_seeds"].to_numpy())
    # the same runs without their repeats: the residual holds B C, and A is lost in it
    alone = screen(design.iloc[:16], codes, y[:16])
    a, b = (s.table.set_index("code").loc["A", "p"] for s in (found, alone))
    assert (alone.method, found.seed_sd is not None) == ("residual", True)
    assert a < 0.05 < b
    # and it is named, with the pairs that these runs do not tell from it
    first = interactions(design, codes, y)
    assert {"BC", "AD", "FG"} & set(first["pair"][:3])
    assert set(first["pair"][np.isclose(first["sum_sq"], first["sum_sq"][0])]) >= {"BC"}


def test_what_a_stage_above_has_without_a_value_has_not_failed_in_the_chain(
    config_of_salt, with_data
):
    """The chain makes such a run itself, for it wants the state too; a run of its own that failed
    leaves what repeats it."""
    config, _ = config_of_salt
    plan = with_data / config.results / config.name / "screening" / "plan.json"
    write(plan, {"heap-1": {}, "heap-2": {}})
    for name, file in (("heap-1", "failed.json"), ("heap-2", "failed.yaml")):
        write(with_data / config.runs / name / file, {})
    assert progress.progress(config).failed == ["heap-2"]


def test_no_two_stages_have_the_same_seeds():
    """The first runs at the candidate and those that they ask for are one stage's, and so are the
    first joint runs and those that are added."""
    found = {}
    for name, rule in rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT).items():
        found.setdefault(rule.seeds, set()).add(name)
    assert found.pop(3) == {"plan_candidate_first", "plan_candidate"}
    assert found.pop(7) == {"plan_joint_first", "plan_joint"}
    assert found.pop(None)
    assert sorted(found) == [0, 1, 2, 4, 5, 8, 9]
    assert all(len(names) == 1 for names in found.values())


@pytest.fixture
def config_of_salt(repository):
    config = parse_config(yaml.safe_load(Path("config/config.yaml").read_text()))
    return config, read_factors(config.factors)


def plan_both(config, folder):
    """Plan the first runs at the candidate, and then all of them in `folder`."""
    source = Files(optimum=folder / "optimum.json", first=folder / "first" / "design.csv")
    plan_candidate_first(Study(config), source, PlanFiles.of(folder / "first"))
    names = {"design": "design.csv", "plan": "plan.json", "region": "region.json"}
    output = Files(**{name: folder / file for name, file in names.items()})
    plan_candidate(Study(config), source, output)


def test_the_region_moves_where_the_target_lies_outside(config_of_salt, tmp_path):
    config, factors = config_of_salt
    rules = config.optimise.model_copy(update={"candidate_half_width": None})
    config = config.model_copy(update={"optimise": rules})
    codes = {"salt_salt_restitution", "salt_salt_rolling_friction", "salt_steel_rolling_friction"}
    region = [f for f in factors if f.name in codes]
    edge = {f.name: f.high for f in region}
    moved = _moved(config, region, edge)
    for old, new in zip(region, moved, strict=True):
        assert new["high"] - new["low"] == pytest.approx(old.high - old.low)
        assert new["low"] > old.low
        assert new["high"] <= physical_range(old.key, "heap")[1]
    (tmp_path / "optimum.json").write_text(
        json.dumps({"optimum": edge, "attainable": False, "moved_region": moved})
    )
    plan_both(config, tmp_path)
    design = pd.read_csv(tmp_path / "design.csv")
    assert json.loads((tmp_path / "plan.json").read_text()) == {}  # the first plan has them all
    rules = config.response_surface
    assert len(design) == len(box_behnken(region, rules.centre_runs, rules.replicates))
    written = json.loads((tmp_path / "region.json").read_text())
    assert written == {"moved": True, "region": moved}
    # back inside: repeats at the candidate, an outlier's point with new seeds, and the region of
    # the surface
    again = {"optimum": edge, "repeat": [{f.name: f.low for f in region}]}
    again["region"] = [vars(f) for f in region]
    (tmp_path / "optimum.json").write_text(json.dumps(again))
    plan_both(config, tmp_path)
    written = json.loads((tmp_path / "region.json").read_text())
    assert written == {"moved": False, "region": again["region"]}
    assert len(pd.read_csv(tmp_path / "design.csv")) == config.optimise.candidate_runs + 2


@pytest.mark.slow
def test_the_interval_of_one_factor_holds_the_truth_as_often_as_it_says(monkeypatch):
    """Over the runs and the measurement drawn anew: the level at which the true mean is the true
    target."""
    monkeypatch.setattr(surfaces, "GRID", 401)
    design, codes, held, draws = box_behnken(factors(3), 5), list("ABC"), 0, 4000
    x, level = design[codes].to_numpy(), 0.15
    true = 45.0 + 4.0 * x[:, 0] + x[:, 1] - 0.8 * x[:, 2] + 0.5 * x[:, 0] ** 2
    target = 45.0 + 4.0 * level + 0.5 * level**2
    rng = np.random.default_rng(12)
    matrix = model_matrix(x, codes, quadratic_terms(codes))
    surface = fit_surface(design, codes, true + rng.normal(size=len(x)))
    along = np.zeros((401, 3))
    along[:, 0] = np.linspace(-1.0, 1.0, 401)
    for _ in range(draws):
        y = true + rng.normal(0.0, 0.8, len(x))
        beta = surface.inverse @ matrix.T @ y
        sigma2 = float(((y - matrix @ beta) ** 2).sum()) / surface.df
        one = replace(surface, beta=beta, sigma2=sigma2)
        measured = target + rng.normal(0.0, 0.16)
        point = along[np.argmin(np.abs(one.predict(along) - measured))]
        low, high = parameter_interval(one, measured, point, 0, target_se=0.16)
        held += low <= level <= high
    assert 0.94 <= held / draws <= 0.96


CENTRE = {"salt_steel_rolling_friction": 0.3, "salt_salt_restitution": 0.5}
CENTRE["salt_salt_rolling_friction"] = 0.2
NAMES = "runs coefficients anova diagnostics predicted residuals perturbation surfaces summary"


def _fitted(config, monkeypatch, folder, lost):
    """(design, summary) of the stage with a response that scatters and the run `lost` without."""
    rules = config.response_surface.model_copy(update={"replicates": 1})
    study = Study(config.model_copy(update={"response_surface": rules}))
    (folder / "ascent.json").write_text(json.dumps({"centre": CENTRE}))
    region = folder / "region.json"
    planned = SimpleNamespace(plan=PlanFiles.of(folder).plan, region=region)
    plan_response_surface(study, SimpleNamespace(ascent=folder / "ascent.json"), planned)
    rng = np.random.default_rng(4)

    def responses(table, _):
        y = 45 + 2 * table["C"] - table["E"] * table["G"] + rng.normal(0, 0.5, len(table))
        return table.assign(response=y.where(table["run"] != lost))

    monkeypatch.setattr("calibration.stages.response_surface.with_responses", responses)
    monkeypatch.setattr("calibration.chain.responses.reason_without", lambda name: "it clogged")
    files = {name: folder / f"{name}.svg" for name in NAMES.split()}
    output = Files(further={}, **files)
    source = SimpleNamespace(design=folder / "design.csv", region=region)
    response_surface(study, source, output)
    return pd.read_csv(folder / "design.csv"), json.loads(output.summary.read_text())


def test_a_lost_edge_leaves_the_opposite_run_alone(config_of_salt, monkeypatch, tmp_path):
    design, summary = _fitted(config_of_salt[0], monkeypatch, tmp_path, lost=12)
    lost = design.loc[design["run"] == 12, ["C", "E", "G"]].to_numpy()[0]
    opposite = design.loc[(design[["C", "E", "G"]].to_numpy() == -lost).all(axis=1), "run"]
    assert summary["decide_alone"] == list(opposite) == [9]
    assert summary["left_out"] == [{"run": 12, "reason": "it clogged"}]
    assert summary["statistics"]["R2_pred"] is summary["statistics"]["PRESS"] is None
    less = summary["reduced"]["statistics"]["R2_pred"]
    assert 0 < less < 1
    said = " ".join(STAGES[0].sentences(summary, ANGLE))
    assert tells(said, "Run 9")
    assert tells(said, f"{less:.3f}")
    assert "nan" not in said


@dataclass
class Known:
    """A response surface given by its formula."""

    codes: str
    formula: object

    def predict(self, levels):
        return self.formula(*np.atleast_2d(np.asarray(levels, float)).T)

    def standard_error(self, levels):
        x = np.atleast_2d(np.asarray(levels, float))
        return np.sqrt(0.1 + ((x - 0.9) ** 2).sum(1))


PLANE = Known("AB", lambda a, b: 1.0 + a + 0.5 * b)
BALL = Known("ABC", lambda a, b, c: a**2 + b**2 + c**2)
SADDLE = Known("ABC", lambda a, b, c: 45 + 2 * a - b + 0.5 * c + a * b - b**2 + 0.3 * c**2)


@pytest.mark.parametrize("surface", [PLANE, BALL, SADDLE])
def test_extent_agrees_with_a_search_of_the_whole_cube(surface):
    k, n = len(surface.codes), 81
    grid = np.array(list(product(np.linspace(-1, 1, n), repeat=k)))
    values = surface.predict(grid)
    target = float(np.quantile(values, 0.35))
    solution = solve(surface, target)
    assert np.allclose(surface.predict(solution.points), target, atol=1e-4)
    # between neighbours of the grid the response crosses the target somewhere
    cube = values.reshape([n] * k) - target
    for axis, (low, high) in enumerate(zip(solution.low, solution.high, strict=True)):
        crossed = set()
        for other in range(k):
            first, last = (
                np.split(np.moveaxis(cube, other, 0), [-1])[0],
                np.moveaxis(cube, other, 0)[1:],
            )
            hits = np.argwhere(first * last <= 0)
            order = [other, *(i for i in range(k) if i != other)]
            crossed |= {int(h[order.index(axis)]) for h in hits}
        line = np.linspace(-1, 1, n)
        assert low == pytest.approx(line[min(crossed)], abs=2.5 / n)
        assert high == pytest.approx(line[min(max(crossed) + 1, n - 1)], abs=5 / n)


def test_the_closest_point_of_a_plane_is_the_foot_of_its_normal():
    # distance of the line a + b/2 = 0.2 from the centre, along (1, 1/2)
    solution = solve(PLANE, 1.2)
    assert solution.attainable
    assert solution.chosen == pytest.approx(np.array([1.0, 0.5]) * 0.2 / 1.25, abs=1e-6)


def test_no_sampled_point_is_closer_to_the_centre_than_the_chosen_one():
    solution = solve(SADDLE, 44.5)
    assert (solution.chosen**2).sum() <= (solution.points**2).sum(1).min() + 1e-9
    assert solution.predicted == pytest.approx(44.5, abs=1e-3)


def test_a_target_out_of_reach_gives_the_nearest_corner():
    solution = solve(PLANE, 3.0)
    assert not solution.attainable
    assert solution.chosen == pytest.approx([1.0, 1.0], abs=1e-6)
    assert solution.predicted == pytest.approx(2.5, abs=1e-6)
