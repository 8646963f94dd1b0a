"""The angle over the pour rate: planned at the optimum, told with its intervals and the orifice's
capacity."""

import re
from pathlib import Path

import pandas as pd
import pytest

from calibration.chain.study import Study
from calibration.errors import CalibrationError
from calibration.figures import ANGLE
from calibration.runs.plans import read_plan
from calibration.stages.pour_rate import STAGES
from facts import refused, tells
from made_up import HEAP, answer, made_up
from small_heap import RUN
from stage_files import write
from workflow_rules import rules_of

KEYS = {"rolling": "contacts.particle_particle.rolling_friction"}
RULES = {"rates_per_s": [500, 1000, 2000], "heaps": 8, "opened": {"funnel_top_diameter_mm": 90.0}}


def config_of(tmp_path, monkeypatch, rules=RULES):
    return made_up(tmp_path, monkeypatch, KEYS, pour_rate=rules,
                   run={"materials": RUN["materials"], "contacts": RUN["contacts"]} | HEAP,
                   tests={"heap": {"experiment": "heap"}})  # fmt: skip


def poured(config, angle):
    """The stage as the workflow calls it; angle(geometry, rng) is what a heap gives."""
    study = Study(config)
    write(study.folder / "optimise" / "optimum.json", {"optimum": {"rolling": 0.2}})
    rules = rules_of(config.model_dump(mode="json"))
    plan, analysis = rules["plan_pour_rate"], rules["pour_rate"]
    plan.call(study)

    def metrics(spec, rng):
        value = angle(spec["geometry"], rng)
        return {} if value is None else {"angle_of_repose_deg": value, "hold_up": 3}

    answer(plan.plan, metrics)
    analysis.call(study)
    return study.summary("pour_rate"), read_plan(plan.plan)


def faster_is_steeper(geometry, rng):
    if geometry.get("feed") == "opened":
        return 46.0 + 0.3 * rng.standard_normal()
    return 40.0 + 0.002 * geometry["generation_rate_per_s"] + 0.3 * rng.standard_normal()


def test_the_angle_over_the_rate_is_told(tmp_path, monkeypatch):
    found, plan = poured(config_of(tmp_path, monkeypatch), faster_is_steeper)
    assert len(plan) == 4 * 8
    friction = {s["contacts"]["particle_particle"]["rolling_friction"] for s in plan.values()}
    assert friction == {0.2}
    rows = {row["rig"]: row for row in found["rigs"]}
    assert list(rows) == ["500", "1000", "2000", "opened"]
    for rig, expected in (("500", 41.0), ("1000", 42.0), ("2000", 44.0), ("opened", 46.0)):
        assert rows[rig]["mean"] == pytest.approx(expected, abs=0.4)
        assert rows[rig]["low"] < rows[rig]["mean"] < rows[rig]["high"]
    # 100 grains of 2 mm make a rate in grams
    grain = found["grain_g"]
    assert rows["1000"]["rate_g_s"] == pytest.approx(1000 * grain)
    said = STAGES[0].sentences(found, ANGLE)
    most = re.search(r"differs by up to \+([\d.]+)°", said[0])[1]
    assert float(most) == pytest.approx(3.0, abs=0.4)
    mean = f"{rows['opened']['mean']:.2f}"
    assert tells(said[1], "funnel", "filled", "opened", f"{mean}°")
    assert f"{found['capacity_per_s']:.0f} grains/s (Beverloo)" in said[2]
    table = pd.read_csv("results/made-up/pour_rate/rates.csv")
    assert len(table) == 4
    assert "<path" in Path("results/made-up/pour_rate/pour_rate.svg").read_text()


def test_a_rate_without_heaps_is_left_out_and_none_is_an_error(tmp_path, monkeypatch):
    config = config_of(tmp_path, monkeypatch, {"rates_per_s": [500, 1000], "heaps": 2})

    def slow(geometry, rng):
        return 40.0 + rng.random() if geometry["generation_rate_per_s"] == 500 else None

    found, _ = poured(config, slow)
    assert [row["rig"] for row in found["rigs"]] == ["500"]
    assert len(STAGES[0].sentences(found, ANGLE)) == 1
    (tmp_path / "other").mkdir()
    config = config_of(tmp_path / "other", monkeypatch, {"rates_per_s": [500, 1000], "heaps": 2})
    with refused(CalibrationError, "rate", "two heaps"):
        poured(config, lambda g, rng: None)
