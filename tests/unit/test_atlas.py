"""The atlas: its runs have no unit, an emulator by the nearest of them knows its error, and an
estimate says what readings ask for, what they leave open, and what lies outside."""

import math
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from new_studies import begun, read

from calibration.atlas import runs
from calibration.atlas.emulators import AtlasEmulators, inputs_of, nearest
from calibration.atlas.rigs import GRAIN, ONE, RIGS
from calibration.atlas.runs import compare, design, kept, trained
from calibration.chain.study import Study
from calibration.files import read_json
from calibration.interface.commands import main
from calibration.runs.plans import read_plan
from calibration.runs.store import RunStore
from calibration.stages.joint import first_points
from calibration.statistics.design import space_filling
from calibration.study.config.joint import joint_targets
from calibration.study.factors import read_factors
from dem.results import write_result
from dem.spec import parse_spec
from facts import ROOT, tells
from workflow_rules import rules_of

RIG = ["--grain=4mm", "--density=1.3g/cm3", "--orifice=40mm", "--plate=160mm", "--height=100mm"]


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_a_run_spec_tells_the_inputs_that_it_was_made_of(rig):
    for at in design(rig)[:40]:
        found = inputs_of(rig, parse_spec(rig.spec(at, 1)))
        assert found == pytest.approx(at, rel=0.01, abs=1e-9)  # a whole number of grains


def test_grains_of_another_size_in_a_rig_as_much_larger_are_the_same_run():
    rig = RIGS["heap"]
    at = design(rig)[3]
    own, large = rig.spec(at, 1), rig.spec(at, 1) | rig.run(at, 10 * ONE.mm)
    large["particles"] |= {"diameter_mm": 10 * ONE.mm, "elongation": at["elongation"]}
    assert large["geometry"]["plate_diameter_mm"] == 10 * own["geometry"]["plate_diameter_mm"]
    assert inputs_of(rig, parse_spec(large)) == pytest.approx(inputs_of(rig, parse_spec(own)))


def test_a_bond_number_is_the_pull_off_force_over_the_weight():
    rig = RIGS["density"]
    at = next(at for at in design(rig) if at["bond_number"] > 1.0)
    spec = parse_spec(rig.spec(at, 1))
    pull = 3.0 * math.pi * spec.law_parameters.surface_energy_J_m2 * 1e-3 * ONE.mm / 4.0
    weight = spec.materials.particle.density_kg_m3 * 9.81 * math.pi / 6.0 * (1e-3 * ONE.mm) ** 3
    assert pull / weight == pytest.approx(at["bond_number"])


@pytest.mark.parametrize("name", ["heap", "cylinder", "density", "drum"])
def test_an_emulator_without_a_run_misses_it_by_the_error_that_it_states(name):
    metric = next(iter(RIGS[name].readings))
    process = nearest(name, metric, np.full(len(RIGS[name].all_inputs), 0.5), range(5))
    error, sd = process.left_out()
    sticky = process.x[:, [i.name for i in GRAIN].index("bond_number")] > 0.0
    pulls = error / (np.array(trained(name)[metric]["wider"])[sticky.astype(int)] * sd)
    assert 0.6 < np.std(pulls) < 1.25
    assert abs(np.mean(pulls)) < 0.2


def told(capsys, *words):
    """What `dem estimate` prints."""
    assert main(["estimate", *RIG, *words]) == 0
    return capsys.readouterr().out


@pytest.mark.slow
def test_a_steeper_heap_asks_for_more_friction(capsys, tmp_path):
    means = []
    for n, angles in enumerate((["24", "25", "24.5"], ["33", "34", "33.5"])):
        out = tmp_path / str(n)
        text = told(capsys, "--measured", *angles, f"--out={out}")
        assert "The test to make next" in text or "No test is expected" in text
        assert all(f"Expected of {rig}" in text for rig in ("cylinder", "density", "drum"))
        means.append(pd.read_csv(out / "parameters.csv").set_index("parameter")["mean"])
        assert (out / "pairs.svg").stat().st_size > 1000
        heap = pd.read_csv(out / "targets.csv").iloc[0]  # the error of the atlas makes the pull
        assert heap["pull"] * heap["sd"] == pytest.approx(heap["measured"] - heap["predicted"])
        rigs = pd.read_csv(out / "predictions.csv").set_index("rig")["geometry"]
        assert rigs.drop("heap").str.startswith("grains 4 mm, ").all()  # the laboratory's own
        assert "times as large as yours" not in text  # the heap has them too, on 40 of them
        assert tells(rigs["drum"], "drum diameter", "rotation rate")
    bounce = "grain_grain_restitution"  # friction makes up for it: its mean may go either way
    assert (means[1].drop(bounce) > means[0].drop(bounce)).all()


@pytest.mark.parametrize("name", ["heap", "cylinder"])
def test_grains_that_bounce_lie_flatter(name):
    rig = RIGS[name]
    process = nearest(name, "angle_of_repose_deg", np.full(len(rig.all_inputs), 0.5), range(5))
    u = np.full((64, len(rig.all_inputs)), 0.5)
    u[:, :5], u[:, 5:7] = space_filling(64, 5, 1), 0.0  # dry spheres of all frictions
    plain, bouncy = (process.mean(np.column_stack([u[:, :4], np.full(64, e), u[:, 5:]]))[0].mean()
                     for e in (0.5, 1.0))  # fmt: skip
    assert bouncy < plain - 2.0


@pytest.mark.slow
def test_one_reading_is_enough_and_what_lies_outside_is_left_out(capsys, tmp_path):
    heap = "--measured 30 sd=1 --rim 6mm --discharge 180g/s 190g/s orifice=35mm silo=150mm".split()
    beside = "--lifted-cylinder 12 sd=1 --tilted-plane 24.5 25.1".split()
    text = told(capsys, *heap, *beside, f"--out={tmp_path / 'out'}")
    assert tells(text, "heap", "rim")
    assert tells(text, "silo", "8.75", "5 to 7")
    known = pd.read_csv(tmp_path / "out/parameters.csv").set_index("parameter")
    assert known.loc["grain_wall_static_friction", ["low", "high"]].between(0.44, 0.48).all()
    expected = pd.read_csv(tmp_path / "out/predictions.csv")
    assert (expected[["low", "run_low"]] >= 0.0).all(axis=None)


@pytest.mark.slow
def test_the_usual_rigs_are_as_wide_as_long_grains_need(capsys):
    own = [option for option in RIG if not option.startswith("--grain")]
    assert main(["estimate", *own, "--axes=5x3.7x3.5mm", "--measured", "30", "31", "32"]) == 0
    said = capsys.readouterr().out
    assert tells(said, "silo", "mass flow", "orifice diameter")


@pytest.mark.slow
def test_an_angle_that_nothing_meets_gets_no_intervals(capsys, tmp_path):
    text = told(capsys, "--measured", "48", "48.5", "49", f"--out={tmp_path / 'out'}")
    assert {f.name for f in (tmp_path / "out").iterdir()} == {"estimate.json", "targets.csv"}
    assert "Expected of" not in text


def test_a_reader_that_stops_is_no_fault(tmp_path):
    words = "-m calibration.interface.commands new peas --no-pilot --measured 30 31".split()
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, *words, *RIG], cwd=tmp_path, **pipes) as run:
        run.stdout.close()
        assert run.stderr.read() == b""


def test_what_lies_outside_is_refused_with_what_is_allowed(capsys, monkeypatch, tmp_path):
    assert main(["estimate", *RIG, "--measured", "30", "31", "--height=400mm"]) == 2
    error = capsys.readouterr().err
    assert re.search(r"height of the orifice.* 5; allowed: 0\.5 to 2\.5", error)
    monkeypatch.setattr("calibration.interface.estimate.estimate_of", None)  # before all else
    assert main(["estimate", *RIG, "--measured", "30", "31", f"--out={tmp_path}"]) == 2
    assert "exists already" in capsys.readouterr().err


def test_runs_of_another_engine_are_told_apart_where_they_differ(tmp_path):
    old = kept("density").head(30)
    found = {}
    for shift in (0.0, 0.02):
        old.assign(poured_density_kg_m3=old["poured_density_kg_m3"] + shift * (1 + old["run"] % 2)
                   ).to_csv(tmp_path / "part.csv", index=False)  # fmt: skip
        compare("density", [tmp_path / "part.csv"], tmp_path / "out.csv")
        rows = pd.read_csv(tmp_path / "out.csv").set_index("metric")["stands"]
        found[shift] = rows["poured_density_kg_m3"], rows["poured_solid_fraction"]
    assert found == {0.0: (True, True), 0.02: (False, True)}


def test_a_part_has_the_runs_of_its_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "PART", 2)
    runs.make("density", 1, tmp_path / "part.csv")
    table, names = pd.read_csv(tmp_path / "part.csv"), [i.name for i in RIGS["density"].all_inputs]
    assert list(table["run"]) == [2, 3]
    assert table[names].to_dict("records") == design(RIGS["density"])[2:4]
    assert table["poured_density_kg_m3"].between(0.3, 0.7).all()


@pytest.mark.slow
def test_few_runs_correct_an_atlas_that_is_off(tmp_path, monkeypatch):
    """Heaps are 4 degrees steeper than the atlas has them: ten runs where it expects the answer,
    and four more, find parameters that meet the measured angle."""
    monkeypatch.chdir(tmp_path)
    begun("peas", ["--measured", "29", "30", "31", *RIG])
    by = {"test": "heap", "by": "atlas"}
    joint = {"runs": 10, "repeated": 0, "second_wave": 4}
    config = read("peas", supplements=["joint"], calibrate=by, joint=joint)
    study, rules = Study(config), rules_of(config.model_dump(mode="json"))
    atlas = AtlasEmulators(config, study.factors).of("heap", "angle_of_repose_deg")

    def angle(levels, scatter=0.0):
        u = [(levels[f.name] - f.low) / (f.high - f.low) for f in study.factors]
        return 4.0 + atlas.mean(np.array([u]))[0][0] + scatter

    rng = np.random.default_rng(1)
    for name in ("plan_joint_first", "plan_joint", "joint", "plan_validation"):
        rules[name].call(study)
        if rules[name].plan:
            specs = read_plan(rules[name].plan)
            design = pd.read_csv(rules[name].output.design).set_index("run_id")
            for run, spec in specs.items():
                found = {"angle_of_repose_deg": angle(design.loc[run], 0.7 * rng.standard_normal())}
                folder = RunStore().folder(run)
                write_result(folder, parse_spec(spec), found, {}, files=())
    design, draws = study.table("joint", "design"), study.table("joint", "draws")
    assert len(design) == 14
    (told,) = read_json(study.folder / "joint/joint.json")["targets"]
    true = [angle(row) for _, row in draws.head(200).iterrows()]
    assert np.mean(true) == pytest.approx(30.0, abs=1.0)  # 34 where nothing were corrected
    assert np.std(true) == pytest.approx(told["sd"], rel=0.3)
    assert angle(draws.iloc[0]) == pytest.approx(30.0, abs=told["sd"])  # of the nearest half
    handed_out = study.table("validation", "design")[[*draws]].drop_duplicates()
    assert handed_out.to_dict("records") == [pytest.approx(draws.iloc[0].to_dict())]
    assert not (study.folder / "response_surface").exists()  # nothing was searched
    # the first stood nearer to what the atlas, as it is, expects than points all over the levels
    own = study.table("joint_first", "design")
    spread = first_points(config, "heap", len(study.factors))
    u = [(own[f.name] - f.low) / (f.high - f.low) for f in study.factors]
    near, far = (np.abs(atlas.mean(x)[0] - 30.0).mean() for x in (np.column_stack(u), spread))
    assert len(own) == len(spread) == 10
    assert near < far
    config.tests["heap"].run["geometry"]["plate_diameter_mm"] = 220.0
    config.tests["heap"].run["particles"]["count"] *= 2  # a wider plate takes more
    config.tests["heap"].run["laws"] = {"rolling": "constant_torque"}
    said = " ".join(AtlasEmulators(config, study.factors).said([]))
    assert tells(said, "counts as 50", "rolling is constant_torque", "elastic_plastic in the atlas")


def test_a_study_outside_of_the_atlas_begins_all_over_the_levels(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    begun("peas", ["--measured", "29", "30", "31", "--rim=5mm", *RIG])
    config = read("peas", supplements=["joint"], calibrate={"test": "heap", "by": "atlas"})
    study = Study(config)
    rules_of(config.model_dump(mode="json"))["plan_joint_first"].call(study)
    own = study.table("joint_first", "design")
    levels = [(own[f.name] - f.low) / (f.high - f.low) for f in study.factors]
    spread = first_points(config, "heap", len(study.factors))
    assert np.column_stack(levels) == pytest.approx(spread, abs=1e-6)
    (told,) = AtlasEmulators(config, study.factors).said(joint_targets(config))
    assert tells(told, "heap", "plate_rim_height_mm is 5.0")


@pytest.mark.slow
def test_the_page_s_python_tells_the_parameters_of_a_study(monkeypatch):
    block = re.search(r"```python\n(.*?)```", (ROOT / "docs/atlas.md").read_text(), re.DOTALL)[1]
    *lines, last = block.strip().splitlines()
    monkeypatch.chdir(ROOT)
    names = {}
    exec("\n".join(lines), names)
    table = eval(last, names)
    assert list(table["parameter"]) == [f.name for f in read_factors("examples/maize/factors.tsv")
                                        if f.key in {i.key for i in GRAIN}]  # fmt: skip


def test_the_atlas_names_each_of_its_inputs_once():
    for rig in RIGS.values():
        names = [i.name for i in rig.all_inputs]
        assert len(set(names)) == len(names) > len(GRAIN)
