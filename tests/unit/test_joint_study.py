"""A joint study as the workflow runs it, on answers in closed form: plan, second wave, posterior,
criticism, next test; and what is wrong with a laboratory, by line."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.stats import t as student

from calibration.chain.joint.analysis import medoid, middle
from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.figures import ANGLE
from calibration.intake.measurements import Measurement
from calibration.runs.plans import read_plan, write_plan
from calibration.stages.joint import sentences
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.config.measured import sample
from calibration.study.simulated_tests import simulated
from dem.io.files import write_json
from facts import rows_in, tells
from made_up import HEAP, answer, made_up
from stage_files import write
from workflow_rules import rules_of

KEYS = {
    "rolling": "contacts.particle_particle.rolling_friction",
    "friction": "contacts.particle_particle.static_friction",
    "wall": "contacts.particle_wall.static_friction",
}
ROWS = """experiment,quantity,value,unit,sd,n
heap,angle_of_repose,30.2,deg,,
heap,angle_of_repose,29.8,deg,,
heap,angle_of_repose,30.4,deg,,
heap,angle_of_repose,29.6,deg,,
tilt,sliding_angle,20.0,deg,0.6,6
"""
TESTS = {
    "pour": {"experiment": "heap", "run": HEAP},
    "plane": {"experiment": "tilt"},
    "hopper": {"experiment": "discharge"},
}


def laboratory(
    tmp_path,
    monkeypatch,
    rows=ROWS,
    tests=None,
    predict=None,
    low=0.1,
    tests_of_all=(),
    posterior=None,
    **joint,
):
    """The configuration of a study with two tests and a hopper that nobody has measured."""
    joint = {"tests": list(tests_of_all), "runs": 32, "repeated": 10, "second_wave": 8} | joint
    return made_up(
        tmp_path, monkeypatch, KEYS, rows, (low, 0.5), seed=7, supplements=["joint"],
        tests=TESTS | (tests or {}), predict=predict or {}, posterior=posterior or {}, joint=joint,
    )  # fmt: skip


def metrics_of(spec, rng):
    """The heap goes with the sum of two frictions, the plane with the wall's, the hopper with the
    difference."""
    contacts = spec["contacts"]
    rolling = contacts["particle_particle"]["rolling_friction"]
    friction = contacts["particle_particle"]["static_friction"]
    if spec["experiment"] == "heap":
        angle = 15.0 + 25.0 * (rolling + friction) + 0.3 * rng.standard_normal()
        return {"angle_of_repose_deg": angle, "height_mm": 50.0 * np.tan(np.radians(angle))}
    if spec["experiment"] == "shear":
        peak = 1.0 + 4.0 * friction
        return {"shear_stress_kPa": peak, "steady_shear_stress_kPa": 0.6 + 3.0 * rolling}
    if spec["experiment"] == "tilt":
        return {"sliding_angle_deg": 50.0 * contacts["particle_wall"]["static_friction"] + 5.0}
    flow = 60.0 + 80.0 * (rolling - friction) + rng.standard_normal()
    return {"mass_flow_g_s": flow, "emptying_time_s": 240.0 / flow}


def calibrated(config):
    """The stage as the workflow calls it; returns the study."""
    study, rules = Study(config), rules_of(config.model_dump(mode="json"))
    for name in ("plan_joint_first", "plan_joint", "joint"):
        rules[name].call(study)
        if rules[name].plan:
            answer(rules[name].plan, metrics_of)
    return study


SILO = {"experiment": "discharge", "metrics": ["mass_flow_g_s"]}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Folder and configuration of a calibrated study of two tests and a machine."""
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        config = laboratory(
            folder, patch, tests={"silo": SILO}, tests_of_all=list(TESTS),
            predict={"tests": ["silo"], "draws": 40, "replicates": 2},
        )  # fmt: skip
        calibrated(config)
    return folder, config


@pytest.fixture
def two_tests(finished, monkeypatch):
    """`Study` of `finished`, from its own folder."""
    folder, config = finished
    monkeypatch.chdir(folder)
    return Study(config)


def test_runs_are_added_to_the_test_that_few_runs_do_not_tell(tmp_path, monkeypatch):
    config = laboratory(tmp_path, monkeypatch, runs=12, repeated=0)
    found = calibrated(config).summary("joint")
    assert found["runs"] == {"pour": 20, "plane": 12, "hopper": 12}


def test_two_tests_and_a_third_that_is_to_be_made(two_tests):
    study = two_tests
    found = study.summary("joint")
    design = study.table("joint", "design")
    # 32 points, and 10 of them again where runs scatter: they tell both targets well enough
    assert found["runs"] == {"pour": 42, "plane": 32, "hopper": 42}
    assert not read_plan("results/made-up/joint/plan.json")
    pour = design[(design["rig"] == "pour")].head(32)
    hopper = design[(design["rig"] == "hopper")].head(32)
    assert np.allclose(pour[list(KEYS)], hopper[list(KEYS)])
    # (20 - 5) / 50, and an error of 0.6 / sqrt(6) of 50 a unit
    wall = found["parameters"]["wall"]
    assert wall["mean"] == pytest.approx(0.3, abs=0.005)
    assert wall["sd"] == pytest.approx(0.6 / np.sqrt(6) / 50, rel=0.6)
    assert wall["bounded"]
    assert not found["parameters"]["rolling"]["bounded"]
    draws = study.table("joint", "draws")
    assert (draws["rolling"] + draws["friction"]).mean() == pytest.approx(0.6, abs=0.02)
    assert draws[["rolling", "friction"]].corr().iloc[0, 1] < -0.7
    assert not found["agreement"]["contradicts"]
    following = study.table("joint", "next")
    assert tuple(following.loc[0, ["rig", "metric"]]) == ("hopper", "mass_flow_g_s")
    assert following.loc[0, "rolling left"] < 0.5
    said = " ".join(sentences(found, ANGLE))
    assert tells(said, "next", "hopper")
    assert "wall 0." in said
    assert "<path" in Path("results/made-up/joint/pairs.svg").read_text()
    shares = study.table("joint", "predictions").set_index("rig")
    assert shares.loc["plane", "wall share"] > 0.9
    assert shares.loc["hopper", "rolling share"] > 0.5


def chain_runs(study, levels, folder, form=True):
    """Finished runs of the chain's own test as the design of a stage; heaps that do not `form`
    have no angle."""
    table, specs = study.plan_test(levels, simulated(study.config, "pour"), 1)
    write_plan(study.folder / folder / "plan.json", table, specs)
    formula = metrics_of if form else lambda *_: {"height_mm": 1.0}
    answer(study.folder / folder / "plan.json", formula)


def test_the_posterior_of_the_chain_is_the_joint_one_of_its_one_test(two_tests):
    """From the chain's runs in a narrower region: files of one form, and the numbers of the heap
    alone. Where no heap formed the draws are few."""
    study, rng = two_tests, np.random.default_rng(3)
    region = [
        {"code": c, "name": n, "key": KEYS[n], "low": low, "high": low + 0.3}
        for c, n, low in (("A", "rolling", 0.2), ("B", "friction", 0.15))
    ]
    write_json(study.folder / "optimise/optimum.json", {"region": region})
    levels = pd.DataFrame(
        {f["name"]: np.repeat(f["low"] + 0.3 * rng.random(24), 2) for f in region}
    ).assign(wall=0.3)
    chain_runs(study, levels[levels["rolling"] < 0.45], "response_surface")
    chain_runs(study, levels[levels["rolling"] < 0.45], "ascent")  # the same runs count once
    chain_runs(study, levels[levels["rolling"] >= 0.45], "candidate", form=False)
    lost, far = (levels["rolling"] >= 0.45).sum(), levels.head(1).assign(rolling=0.1)
    assert lost >= 4
    chain_runs(study, far, "ascent")
    rules_of(study.config.model_dump(mode="json"))["posterior"].call(study)
    found, whole = study.summary("posterior"), study.summary("joint")
    assert set(found) == set(whole)
    assert found["runs"] == {"pour": len(levels)}
    assert found["without_value"] == {"pour: angle_of_repose_deg": lost}
    for name in ("targets", "parameters"):
        columns = [list(study.table(stage, name)) for stage in ("posterior", "joint")]
        assert columns[0] == columns[1]
    draws = study.table("posterior", "draws")
    assert list(draws) == ["rolling", "friction"]
    # 30 degrees are a sum of 0.6, known to the readings' 0.18 degrees and the process' error
    assert (draws["rolling"] + draws["friction"]).mean() == pytest.approx(0.6, abs=0.01)
    assert (draws["rolling"] + draws["friction"]).std() < 0.02
    assert draws["rolling"].corr(draws["friction"]) < -0.9
    assert (draws["rolling"] >= 0.45).mean() < 0.05
    following = study.table("posterior", "next")
    assert set(following["rig"]) == {"pour"}
    assert set(following["metric"]) == {"angle_of_repose_deg", "height_mm"}
    (row,) = study.table("posterior", "targets").to_dict("records")
    assert row["measured"] == pytest.approx(30.0)
    assert abs(row["pull"]) < 0.5
    assert "others" not in " ".join(sentences(found, ANGLE))


@pytest.mark.slow
def test_the_set_that_meets_all_tests_goes_to_other_codes(two_tests):
    """Where the report waits for all tests, the set that meets them is validated, answered for and
    handed out, with intervals that hold whatever the others are."""
    study = two_tests
    rules = rules_of(study.config.model_dump(mode="json"))
    for folder in ("screening", "ascent", "response_surface", "candidate_first", "candidate"):
        write(study.folder / folder / "plan.json", {})
    for name in ("plan_validation", "validation", "plan_answer", "answer", "export"):
        rules[name].call(study)
        if rules[name].plan:
            answer(rules[name].plan, metrics_of)
    told = study.summary("answer")
    assert told["by"] == "joint"
    assert {(t["test"], t["state"]) for t in told["tests"]} == {("pour", "met"), ("plane", "met")}
    folder = study.folder / "exports"
    found = yaml.safe_load(Path(rules["export"].output.parameters).read_text())
    values = {name: found["parameters"][key] for name, key in KEYS.items()}
    level = {name: entry["value"] for name, entry in values.items()}
    # 15 + 25 (rolling + friction) and 50 wall + 5 are what was measured
    assert level["rolling"] + level["friction"] == pytest.approx(0.6, abs=0.02)
    assert level["wall"] == pytest.approx(0.3, abs=0.01)
    draws = study.table("joint", "draws")
    assert np.isclose(draws[list(KEYS)], pd.Series(level)).all(axis=1).sum() == 1
    known = study.summary("joint")["parameters"]
    assert all(entry["interval_95"] == known[name]["interval"] for name, entry in values.items())
    assert "not_bounded_by_the_data" not in values["wall"]
    assert values["rolling"]["not_bounded_by_the_data"]
    expected = {(e["rig"], e["metric"]): e for e in found["expected"]}
    assert expected["pour", "angle_of_repose_deg"]["mean"] == pytest.approx(30.0, abs=0.5)
    assert {t["measured"] for t in found["targets"]} == {30.0, 20.0}
    row = rows_in((folder / "edem.md").read_text())["Coefficient of static friction"]
    assert {f"{level['friction']:.6g}", f"{level['wall']:.6g}"} >= {row[0]}
    spec = yaml.safe_load((folder / "dem.yaml").read_text())
    assert spec["contacts"]["particle_wall"]["static_friction"] == level["wall"]
    assert f"{level['friction']:g}"[:6] in (folder / "liggghts.in").read_text()


def test_the_middle_set_is_one_of_the_sets():
    """The mean of draws along an arc meets no target."""
    along = np.linspace(0.0, 1.2, 41)
    arc = pd.DataFrame({"a": np.cos(along), "b": np.sin(along)})
    row = medoid(arc.to_numpy())
    assert 0.2 < along[row] < 1.0
    assert medoid((arc * [1.0, 1e6]).to_numpy()) == row


def test_the_middle_of_a_curved_set_meets_what_was_measured():
    """Draws about a circle: their medoid lies inside of it, the middle one on it."""
    rng = np.random.default_rng(1)
    radius, turn = 1.0 + 0.1 * rng.standard_normal(2000), rng.uniform(0.0, 1.5 * np.pi, 2000)
    draws = pd.DataFrame({"a": radius * np.cos(turn), "b": radius * np.sin(turn)})
    assert radius[medoid(draws.to_numpy())] < 0.85
    assert abs(radius[middle(draws, radius[:, None])] - 1.0) < 0.0675  # the half that is nearest


def test_a_rig_may_hold_a_factor_that_stays_free_in_the_others(tmp_path, monkeypatch):
    tests = {"plane": {"experiment": "tilt", "fixed": {"rolling": 0.0}}}
    config = laboratory(tmp_path, monkeypatch, tests=tests)
    rule = rules_of(config.model_dump(mode="json"))["plan_joint_first"]
    rule.call(Study(config))
    design, key = Study(config).table("joint_first", "design"), "particle_particle"
    for row in design.to_dict("records"):
        level = read_plan(rule.plan)[row["run_id"]]["contacts"][key]["rolling_friction"]
        assert level == (0.0 if row["rig"] == "plane" else row["rolling"])
    assert design[design["rig"] == "plane"]["rolling"].between(0.1, 0.5).all()
    assert len(design) == len(read_plan(rule.plan)) == 42 + 32 + 42


def test_draws_of_all_targets_go_through_a_machine(two_tests):
    """The draws hold the sum of two frictions; a silo flows with their difference, and not with the
    wall's."""
    study = two_tests
    rules = rules_of(study.config.model_dump(mode="json"))
    rules["plan_joint_push_through"].call(study)
    answer(rules["plan_joint_push_through"].plan, metrics_of)
    rules["joint_push_through"].call(study)
    (row,) = study.summary("joint_push_through")["metrics"]
    draws = study.table("joint", "draws")
    flow = 60.0 + 80.0 * (draws["rolling"] - draws["friction"])
    assert row["mean"] == pytest.approx(flow.mean(), abs=4.0)
    assert row["sd_parameters"] == pytest.approx(flow.std(), rel=0.4)
    assert row["decides"] in ("rolling", "friction")


@pytest.mark.slow
def test_a_region_is_not_widened_beyond_what_is_possible(tmp_path, monkeypatch):
    rows = ROWS.replace("20.0,deg,0.6", "5.2,deg,0.6")  # friction 0.004 on the wall, from 0.01
    found = calibrated(laboratory(tmp_path, monkeypatch, rows, low=0.01)).summary("joint")
    wall = found["parameters"]["wall"]
    assert (wall["border"], wall["reach"], wall["reach_is_limit"]) == ("low", 0.0, True)
    said = " ".join(sentences(found, ANGLE))
    assert tells(said, "wall", "low border", "0.01", "at 0", "least", "possible")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tests_of_all": ["drum"]}, ["joint.tests", "drum", "pour, plane, hopper"]),
        ({"tests": {"pour": {"experiment": "heap", "metrics": ["sliding_angle_deg"]}}},
         ["tests.pour.metrics", "sliding_angle_deg", "angle_of_repose_deg"]),
        ({"tests_of_all": ["hopper"]}, ["measured.csv", "no row", "hopper"]),
        ({"rows": ROWS.replace("0.6,6", ",")}, ["measured.csv", "line 6", "has no error"]),
        ({"rows": ROWS + "tilt,sliding_angle,30.0,deg,0.6,6\n"}, ["line 7", "line 6"]),
        ({"rows": ROWS.replace("20.0,deg", "20.0,kPa")}, ["line 6", "unit", "deg"]),
        ({"posterior": {"priors": {"wall": {"mean": 0.3, "sd": 0.1}}}},
         ["posterior.priors.wall.source"]),
        ({"posterior": {"priors": {"wall": {"mean": 0.9, "sd": 0.1, "source": "a paper"}}}},
         ["posterior.priors.wall.mean", "0.1 to 0.5"]),
        ({"factors": ["rolling", "speed"]}, ["joint.factors", "speed"]),
        ({"tests": {"plane": {"experiment": "tilt", "fixed": {"speed": 1.0}}}},
         ["tests.plane.fixed", "speed"]),
        ({"posterior": {"hours": {"silo": 2.0}}}, ["posterior.hours", "silo"]),
        ({"repeated": 40}, ["joint.repeated", "32"]),
    ],
)  # fmt: skip
def test_a_wrong_laboratory_is_refused_by_line(tmp_path, monkeypatch, changes, words):
    with pytest.raises(ConfigError) as error:
        laboratory(tmp_path, monkeypatch, **changes)
    for word in words:
        assert word in str(error.value)


PLANES = "experiment,quantity,value,unit,sd,n,batch\n" + "".join(
    f"heap,angle_of_repose,{v},deg,,,\n" for v in (30, 31)
)


def test_batches_are_pooled_and_those_that_differ_are_the_readings(tmp_path, monkeypatch):
    def plane(*means):
        rows = (f"tilt,sliding_angle,{v},deg,0.6,6,{k}\n" for k, v in enumerate(means))
        config = laboratory(tmp_path, monkeypatch, PLANES + "".join(rows))
        return read_joint_target(config, joint_targets(config)[1])

    far = plane(20, 24, 22)
    assert (far.mean, far.freedom) == (22.0, 2.0)
    assert far.variance == pytest.approx(4.0 / 3.0)
    near = plane(20.1, 20.0, 19.9)  # less than six readings of 0.6 make of three means
    assert near.variance == pytest.approx((15 * 0.6**2 + 12 * 0.1**2) / 17 / 18)


def test_single_readings_of_a_known_spread_are_not_surer_where_they_agree(tmp_path, monkeypatch):
    """An instrument's spread of 0.5, stated with each of two readings that are nearly alike."""
    rows = "".join(f"tilt,sliding_angle,{v},deg,0.5,1,{k}\n" for k, v in enumerate((20.0, 20.02)))
    config = laboratory(tmp_path, monkeypatch, PLANES + rows)
    found = read_joint_target(config, joint_targets(config)[1])
    assert found.variance == pytest.approx(0.5**2 / 2)
    assert np.isinf(found.freedom)


def test_batches_hold_what_they_say():
    """Of 400 laboratories of four days of five readings, days that differ by thrice a reading's
    spread, 95 % intervals hold the truth in 95 % (92.8 to 97.2 by chance alone, p = 0.01); as 20
    readings that are alike they would in 58 %."""
    rng, held = np.random.default_rng(3), []
    for _ in range(400):
        read = 3.0 * rng.standard_normal((4, 1)) + rng.standard_normal((4, 5))
        days = [
            Measurement("heap", own.mean(), own.std(ddof=1), 5, {}, batch=f"{k}", readings=(*own,))
            for k, own in enumerate(read)
        ]
        mean = sample(days, "measured.csv")
        reach = student.ppf(0.975, len(mean) - 1) * mean.std() / np.sqrt(len(mean))
        held.append(abs(mean.mean()) < reach)
    assert 0.92 < np.mean(held) < 0.975


def test_a_single_reading_counts_with_the_sd_of_one_reading(tmp_path, monkeypatch):
    config = laboratory(tmp_path, monkeypatch, ROWS.replace("0.6,6", "0.5,1"))
    _, plane = (read_joint_target(config, t) for t in joint_targets(config))
    assert plane.variance == pytest.approx(0.25)
    assert np.isinf(plane.freedom)
