"""What cannot be run is told before the first run, what names a run, and what the runs cost."""

import re
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml

from calibration import Study
from calibration.errors import ConfigError
from calibration.intake.tables import read_written
from calibration.runs import feasibility
from calibration.runs.feasibility import chance_to_empty, check_ahead, cost_ahead
from calibration.runs.plans import plan
from calibration.stages.numerics import plan_numerics
from calibration.statistics.design import box_behnken, steepest_path
from calibration.study import cost
from calibration.study.config import given, overlay, parse_config
from calibration.study.config.tests import swept_test
from calibration.study.factors import read_factors
from calibration.study.stage import Plan, Points, Stage
from facts import ROOT, refused, tells

DATA = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())


@pytest.fixture(autouse=True)
def project(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(cost, "machine_memory_mb", lambda: 8000.0)


def without_nulls(data):
    return {k: without_nulls(v) if isinstance(v, dict) else v for k, v in data.items()
            if v is not None}  # fmt: skip


def study(changes):
    """The shipped study with changes; a null takes a key away."""
    return parse_config(without_nulls(overlay(DATA, changes)))


STEEL, SALT = "salt_steel_restitution", "salt_salt_restitution"
NO_SIZE = {"particles": {"diameter_mm": None}}
WRONG = {
    "the store's own name": ({"name": "runs"}, "runs", "name"),
    "a restitution of 5": ({"fixed": {STEEL: 5}}, "restitution = 5.0", "fixed"),
    "a path out of range": ({"ascent": {"step": {SALT: -0.3}}}, SALT, "ascent"),
    "a region out of range": (
        {"response_surface": {"centre": {SALT: 0.9, "salt_salt_rolling_friction": 0.2}}},
        "restitution = 1.05",
        "response_surface",
    ),
    "a bench level out of range": (
        {"tests": {"ball": {"sweep": {"levels": [0.4, 0.5, 0.6, 1.7]}}}},
        "restitution = 1.7",
        "tests.ball.sweep",
    ),
    "a missing design": ({"screening": {"design": "none.csv"}}, "none.csv", None),
    "runs that make no design": (
        {"screening": {"design": None, "kind": "plackett_burman", "runs": 10}},
        "10 runs",
        "screening",
    ),
    "no ball that the heaps wait for": (
        {"fixed_from": "bench", "tests": {"ball": None}},
        "drop",
        "tests",
    ),
    "no density": (
        {"run": {"materials": {"particle": {"density_kg_m3": None}}}},
        "fixed",
        "materials.particle.density_kg_m3",
    ),
    **{
        f"no size of the grains of {where}": (changes, "must be given", "particles.diameter_mm")
        for where, changes in (
            ("the heap", {"tests": {"heap": {"run": NO_SIZE}}}),
            ("the ring", {"tests": {"ring": {"run": NO_SIZE}}}),
            ("the scaling", {"scaling": {"heap": NO_SIZE}}),
        )
    },
    "a factor without a level": ({"fixed": {SALT: None}}, "0.15 to 0.75", f"fixed.{SALT}"),
    "a missing mesh": (
        {"tests": {"heap": {"run": {"geometry": {"plate_stl": "none.stl"}}}}},
        "none.stl",
        "tests.heap.run.geometry.plate_stl",
    ),
}


@pytest.mark.parametrize(("changes", "name", "key"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_run_is_told_first(changes, name, key):
    with refused(ConfigError, name, key=key) as error:
        check_ahead(study(changes))
    assert len(str(error.value).splitlines()) == 1


def test_one_reading_is_refused_before_any_run(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text("experiment,quantity,value,unit,sd,n\nheap,angle_of_repose,31.2,deg,1,1\n")
    with refused(ConfigError, "two values", line=2, column="n"):
        check_ahead(study({"measurements": str(path)}))


def test_a_level_that_a_declared_plan_would_run_is_told_first(monkeypatch):
    """The check has no list of runs of its own."""
    config = study({})

    def ahead(config, factors):
        return [Points("polish.at", pd.DataFrame({SALT: [3.0]}), config.experiment, config.own_run)]

    polish = Stage(name="polish", title="Polish", place=6.5, plans=(Plan("polish", ahead),))
    monkeypatch.setattr(feasibility, "load_stages", lambda: {"polish": polish})
    with refused(ConfigError, "restitution = 3.0", key="polish.at"):
        check_ahead(config)


def test_a_factor_may_have_its_level_from_the_run():
    given = {"contacts": {"particle_particle": {"restitution": 0.5}}}
    check_ahead(study({"fixed": {SALT: None}, "run": given}))


@pytest.mark.parametrize("file", ["config/profiles/quick.yaml", "config/profiles/test.yaml", None])
def test_the_shipped_study_passes(file):
    check_ahead(study(yaml.safe_load(Path(file).read_text()) if file else {}))


def test_a_funnel_that_most_runs_would_clog_is_told_first():
    """25 mm and grains of 4 mm are 3.1 grains in the test profile, of a heap of 200; 7 mm are 3.6
    full. By hand: an arch comes once in 9900 / (4.94 - R)^6.9 grains."""
    assert chance_to_empty(3.125, 200) == pytest.approx(0.29, abs=0.01)
    assert chance_to_empty(3.82, 375) == pytest.approx(0.92, abs=0.01)
    assert chance_to_empty(5.0, 1e6) == 1.0
    run = {"particles": {"count": 1000, "diameter_mm": 8.0},
           "geometry": {"orifice_diameter_mm": 25.0, "generation_rate_per_s": 500}}  # fmt: skip
    rig = {"tests": {"heap": {"run": run}}}
    key = "tests.heap.run.geometry.orifice_diameter_mm"
    with refused(ConfigError, "3.1 grains wide", key=key):
        check_ahead(study(rig))
    run["particles"] = {"count": 1000, "diameter_mm": 5.0}
    check_ahead(study(rig))


def test_more_grains_than_the_machine_holds_are_told_first(monkeypatch):
    grains = {"particles": {"count": 5_000_000}, "geometry": {"generation_rate_per_s": 5e6}}
    tests = {"heap": {"run": grains}}
    many = study({"tests": tests})
    with refused(
        ConfigError,
        "15.2 GB",
        "8.0 GB",
        key="tests.heap.run.particles.count",
        value=5000000,
        allowed="about 2583333 grains",
    ):
        check_ahead(many)
    monkeypatch.setattr(cost, "machine_memory_mb", lambda: 200e3)
    check_ahead(many)
    assert tells(cost_ahead(many), "15250 MB")
    assert re.search(r"\d h \d+ min", cost_ahead(many))


def test_a_rig_that_the_engine_cannot_run_is_told_first():
    """A silo is a rig of LIGGGHTS', a vessel is not."""
    data = yaml.safe_load(Path("examples/other-codes/config.yaml").read_text()) | {"engine": "dem"}
    rigs = {
        "silo": {
            "experiment": "discharge",
            "run": {"geometry": {"orifice_diameter_mm": 30.0, "silo_diameter_mm": 75.0}},
        },
        "vessel": {"experiment": "bulk_density", "run": {"geometry": {"vessel_diameter_mm": 75.0}}},
    }
    for rig in rigs.values():
        rig["run"] |= {"particles": {"count": 4000, "diameter_mm": 5.0}}
        rig["run"] |= {"contacts": data["run"]["contacts"]}
    theirs = {"engine": {"name": "liggghts", "identity": {}, "settings": {}}}

    def check(names):
        tests = data["tests"] | {name: rigs[name] for name in names}
        config = parse_config(data | {"tests": tests})
        check_ahead(config.model_copy(update={"run": config.run | theirs}))

    check(["silo"])
    with refused(ConfigError, "liggghts", "bulk_density", key="tests.vessel"):
        check(["silo", "vessel"])


def test_a_stage_without_its_section_names_stage_and_key():
    config = parse_config(yaml.safe_load(Path("examples/soybean/config.yaml").read_text()))
    with refused(ConfigError, "scaling", key="scaling", value=None):
        given(config, "scaling", "scaling")
    with refused(ConfigError, "tilt", key="tests", value=None):
        swept_test(config, "tilt")


def test_equal_points_share_a_run_and_replicates_do_not():
    config, table = study({}), read_factors("config/factors.tsv")
    chosen = [f for f in table if f.code in "CEG"]
    design = box_behnken(chosen, centre_runs=5)
    planned, specs = plan(design, table, config, config.experiment, config.own_run)
    assert planned["run_id"].is_unique
    assert len(specs) == 17
    centre = {f.name: f.centre for f in chosen}
    path = steepest_path(chosen, centre, {f.name: 0.0 for f in chosen}, 1)
    shared, _ = plan(path, table, config, config.experiment, config.own_run)
    assert shared["run_id"][0] in set(planned["run_id"])


def test_a_variant_may_have_seeds_of_its_own(tmp_path):
    variants = {"coarse": {"run": {}}, "fine": {"against": "coarse", "seeds": 3, "run": {}}}
    points = {"low": {"salt_salt_restitution": 0.2}, "high": {"salt_salt_restitution": 0.7}}
    wanted = {"seeds": 2, "points": points, "variants": variants}
    (tmp_path / "numerics.yaml").write_text(yaml.safe_dump(wanted))
    source = SimpleNamespace(variants=tmp_path / "numerics.yaml")
    plan_numerics(Study("config"), source, SimpleNamespace(plan=tmp_path / "plan.json"))
    design = read_written(tmp_path / "design.csv")
    counts = design.groupby(["variant", "point"], sort=False).size()
    assert counts.to_dict() == {
        ("coarse", "low"): 2, ("coarse", "high"): 2, ("fine", "low"): 3, ("fine", "high"): 3,
    }  # fmt: skip
    assert not design.duplicated(["variant", "point", "seed"]).any()
