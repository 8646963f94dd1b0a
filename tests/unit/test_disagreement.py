"""The paper's tables are read as another code's runs; what may differ is switched on at each."""

import shutil
from itertools import product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration import Study
from calibration.errors import CalibrationError, ConfigError
from calibration.files import read_json
from calibration.intake.measurements import Measurement
from calibration.intake.tables import read_written
from calibration.runs.plans import run_id
from calibration.stages.bench_tests import plan_sweep
from calibration.stages.screening import plan_screening
from diagnosis import switched_causes
from diagnosis.compared import in_part
from diagnosis.other_code import read_runs
from diagnosis.switched_causes import Switched, read_switched
from facts import refused, tells
from frozen import FROZEN
from paper import disagreement as own
from paper.audit.paper import Paper
from paper.reproduction.study import Study as Kept
from paper.rigs import POINTS, RATES, READINGS, SPEEDS, chosen, judged
from paper.stages import CAUSES
from paper_tables import paper_table

KEPT = FROZEN / "salt-paper"
PAPER = Paper("data/paper")


@pytest.fixture(scope="module")
def study():
    return Study("config")


@pytest.fixture(scope="module")
def tables(study, tmp_path_factory):
    folder, out = tmp_path_factory.mktemp("tables"), {}
    for name in own.TABLES:
        path = folder / f"{name}.csv"
        own.runs_table(PAPER, name, study.config.fixed).to_csv(path, index=False)
        out[name] = read_runs(path, study.factors)
    return out


def test_every_printed_run_is_read_with_its_parameters(tables):
    assert {k: len(v) for k, v in tables.items()} == {
        "Table 6": 12, "Table 8": 6, "Table 9": 9, "Table 10": 5, "Table 11": 13,
    }  # fmt: skip
    first = dict(tables["Table 6"][0].known)
    assert (first["salt_steel_rolling_friction"], first["salt_salt_restitution"]) == (0.2, 0.75)
    centre = next(m for m in tables["Table 11"] if m.n == 5)
    assert dict(centre.known)["salt_salt_rolling_friction"] == 0.23
    assert centre.value == pytest.approx(np.mean([46.54, 45.6, 45.7, 45.54, 45.56]))
    assert {m.levers["drop_height_mm"] for m in tables["Table 9"]} == {150.0}


def test_nothing_switched_on_is_the_run_of_the_screening(study, tables, tmp_path):
    made = own.spec_of(study)
    specs = [made(m, dict(m.known), {}) for m in tables["Table 6"]]
    plan_screening(study, None, SimpleNamespace(plan=tmp_path / "plan.json"))
    planned = read_written(tmp_path / "design.csv")
    assert [run_id(s) for s in specs] == list(planned["run_id"])


def test_our_values_are_those_kept_at_the_parameters_of_the_runs(study, tables):
    study_of, kept = [[Kept(KEPT)]], read_written(KEPT / "screening" / "runs.csv")
    ours, counts = own.our_values(tables["Table 6"], study_of, study.config.fixed)
    assert list(counts) == list(kept["response"].notna().astype(int))
    assert ours == pytest.approx(kept["response"], nan_ok=True)
    for name in ("Table 10", "Table 11"):
        assert np.isfinite(own.our_values(tables[name], study_of, study.config.fixed)[0]).all()
    with refused(CalibrationError, "12 of 12"):
        own.our_values(tables["Table 6"], [[Kept("results/none")]], study.config.fixed)


def test_a_row_where_our_run_gave_no_value_is_left_out(study, tables, tmp_path):
    folder = tmp_path / "salt-paper"
    shutil.copytree(KEPT, folder)
    kept = folder / "ascent" / "runs.csv"
    table = read_written(kept)
    table.loc[1, "response"] = np.nan  # a point that no other stage has
    table.to_csv(kept, index=False)
    runs = tables["Table 10"]
    rows = [{"table": "Table 10", "cause": "slow", "strength": 1.0, "run": f"run{i}"}
            for i in range(len(runs))]  # fmt: skip
    metrics = {r["run"]: {"angle_of_repose_deg": 40.0} for r in rows}
    causes = {"heap": {"slow": Switched(kind="rig", run={"seed": 1})}}
    found = own.of_table(study, PAPER, runs, [[Kept(folder)]], rows, causes, metrics)
    assert found["ours_without_value"] == [runs[1].line]
    assert [r["line"] for r in found["rows"]] == [m.line for i, m in enumerate(runs) if i != 1]
    assert tells(own.page({"Table": found}), "no run", f"line {runs[1].line}")
    table["response"] = np.nan
    table.to_csv(kept, index=False)
    with refused(CalibrationError, "5 rows"):
        own.of_table(study, PAPER, runs, [[Kept(folder)]], rows, causes, metrics)


def test_a_bench_test_is_run_as_the_study_runs_it(study, tables, tmp_path):
    made = own.spec_of(study)
    plan_sweep("drop", study, None, SimpleNamespace(plan=tmp_path / "plan.json"))
    planned = list(read_written(tmp_path / "design.csv")["run_id"])
    assert [run_id(made(m, dict(m.known), {})) for m in tables["Table 9"]] == planned


@pytest.mark.parametrize("path", [CAUSES, "config/crossed_causes.yaml"])
def test_each_shipped_cause_changes_every_run_it_is_tried_on(study, tables, path):
    shipped, made = read_switched(path), own.spec_of(study)
    for name, runs in tables.items():
        plain = [run_id(made(m, dict(m.known), {})) for m in runs]
        for words, cause in shipped.get(runs[0].experiment, {}).items():
            rows, specs = switched_causes.plan(name, runs, {words: cause}, made)
            if cause.tables is not None and name not in cause.tables:
                assert rows == []
                continue
            assert len(rows) == len(runs) * len(cause.overlays) * cause.seeds
            same = [r["run"] for r in rows if r["run"] in plain]
            # values that are equal change nothing when they change places; a reading changes no run
            assert not same or cause.metric or (cause.exchange and len(same) < len(runs))
            assert set(specs) == {r["run"] for r in rows}


def test_a_cause_is_judged_by_the_scatter_of_its_own_runs(tables):
    runs, causes = tables["Table 10"], {"rig": Switched(kind="rig", run={"seed": 1}, seeds=3)}
    values = np.random.default_rng(4).normal(45.0, 0.5, (3, len(runs)))
    rows, metrics = [], {}
    for k, i in np.ndindex(values.shape):
        rows.append({"cause": "rig", "strength": 1.0, "replicate": k, "run": f"{k} {i}"})
        metrics[f"{k} {i}"] = {"angle_of_repose_deg": values[k, i]}
    found = own.spreads_of(PAPER, runs, rows, causes, metrics, FROZEN)
    angles = paper_table("table13_validation")["angle_deg"]
    assert found["rig"] == pytest.approx(
        np.sqrt(values.var(axis=0, ddof=1).mean() / 3 + angles.var())
    )
    # one seed a row says nothing of itself: a study in the same rig does
    one = {"rig": Switched(kind="rig", run={"seed": 1}, scatter_of="salt-slow")}
    first = [r for r in rows if r["replicate"] == 0]
    slow = read_json(FROZEN / "salt-slow" / "validation" / "validation.json")["simulated_sd"]
    assert own.spreads_of(PAPER, runs, first, one, metrics, FROZEN)["rig"] == pytest.approx(
        np.hypot(slow, angles.std())
    )


def test_the_seeds_of_one_rig_count_together(study, tables):
    names = ("salt", "salt-2", "salt-3", "salt-4")
    group = [Kept(FROZEN / n) for n in names]
    ours, counts = own.our_values(tables["Table 6"], [group], study.config.fixed)
    every = [pd.read_csv(FROZEN / n / "screening" / "runs.csv")["response"] for n in names]
    assert ours == pytest.approx(pd.concat(every, axis=1).mean(axis=1))
    assert list(counts) == [3 if k == 1 else 4 for k in range(12)]


def test_faults_of_the_file_are_said_by_line(tmp_path):
    path = tmp_path / "causes.yaml"
    path.write_text("heap:\n  a rig:\n    kind: weather\n    run: {}\n")
    with refused(ConfigError, path="causes.yaml", line=3, key="heap.a rig.kind", value="weather"):
        read_switched(path)
    path.write_text(yaml.safe_dump({"heap": {"a": {"kind": "rig"}}}))
    with refused(ConfigError, path="causes.yaml", line=2, key="heap.a", value={"kind": "rig"}):
        read_switched(path)


def test_a_cause_whose_runs_give_no_value_is_told_apart():
    causes = {k: Switched(kind="rig", run={"seed": 1}) for k in ("clogs", "pours")}
    rows = [{"cause": c, "strength": 1.0, "run": f"{c}{i}"} for c in causes for i in range(3)]
    metrics = {r["run"]: {"angle": 30.0} for r in rows} | {"clogs1": None}
    found, without = switched_causes.tried(rows, causes, metrics, "angle")
    assert [c.name for c in found] == ["pours"]
    assert np.isnan(without["clogs"]).tolist() == [[False, True, False]]
    runs = [
        Measurement("heap", v, None, 1, {}, quantity="angle_of_repose") for v in (33.0, 30.0, 34.0)
    ]
    part = in_part(runs, [35.0, 60.0, 34.0], without["clogs"])
    assert part == {
        "runs": 1,
        "others": 2,
        "scatter_before": pytest.approx(2.0**0.5),
        "scatter_after": pytest.approx(12.5**0.5),
    }


def test_the_kept_page_says_what_the_kept_numbers_say():
    folder = KEPT / "disagreement"
    found = read_json(folder / "disagreement.json")
    assert list(found) == list(own.TABLES)
    assert own.page(found) == (folder / "disagreement.md").read_text()


def heaps(change, held=lambda point, rate, speed: 700):
    """Two runs a rig and point; `change` and `held`, functions of (point, rate, speed), give the
    angle and the grains in the funnel."""
    rows = []
    for point, rate, speed, seed in product(POINTS, RATES, SPEEDS, (1, 2)):
        row = {"point": point, "generation_rate_per_s": rate, "injection_speed_m_s": speed}
        angle = change(point, rate, speed) + 0.1 * seed
        row |= {"seed": seed, "hold_up": held(point, rate, speed), **dict.fromkeys(READINGS, angle)}
        rows.append(row)
    return pd.DataFrame(rows)


def test_the_printed_rate_stays_at_the_least_speed_at_which_nothing_moves():
    def angle(point, rate, speed):
        return 45.0 - (2.0 if speed == 0.3 else 0.0)  # only the first speed is another

    rigs = judged(heaps(angle)).set_index(["rate", "speed"])
    assert rigs["well_posed"].to_dict() == {
        (rate, speed): speed == 1.0 for rate in RATES for speed in SPEEDS
    }
    assert rigs.loc[(10000, 0.3), "moves"] == pytest.approx(2.0)
    assert chosen(rigs.reset_index()) == (10000, 1.0)


def test_one_funnel_that_packs_at_one_point_makes_two_kinds():
    def packs(point, rate, speed):
        return 1400 if (point, rate, speed) == ("high", 10000, 1.0) else 700

    rigs = judged(heaps(lambda *_: 45.0, packs))
    assert rigs.loc[~rigs["one_kind"], ["rate", "speed"]].to_numpy().tolist() == [[10000, 1.0]]
    assert chosen(rigs) == (10000, 0.3)


def test_a_run_without_a_value_is_no_rig_of_one_kind():
    table = heaps(lambda *_: 45.0)
    table.loc[table["generation_rate_per_s"] == 10000, "hold_up"] = float("nan")
    assert chosen(judged(table)) == (6500, 0.3)


def test_where_all_move_the_slower_pour_is_taken_at_the_speed_that_moves_it_least():
    def angle(point, rate, speed):
        return 45.0 - speed * (1.0 if rate == 10000 else 2.0) * (3.0 if point == "low" else 1.0)

    def packs(point, rate, speed):
        return 1500 if (point, rate, speed) == ("high", 10000, 0.3) else 700

    rigs = judged(heaps(angle, packs))
    assert not rigs["well_posed"].any()
    # 10,000 moves less and is not well-posed all the same; the last speed has no next one
    assert chosen(rigs) == (6500, 0.3)
    assert rigs.set_index(["rate", "speed"]).loc[(6500, 0.3), "moves"] == pytest.approx(4.2)
