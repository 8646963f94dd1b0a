"""The diagnosis of bulk tests without settings of one's own: what is derived, the budget of runs,
what few runs tell of a mechanism, and free laws along a lever."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from diagnosis_cases import BASE as RUN
from diagnosis_cases import FACTORS, closed_form, trained

from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, QUANTITIES, levers_of
from calibration.study.config.schema import Config
from calibration.study.factors import read_factors
from dem.experiments import experiments
from dem.spec import parse_spec
from diagnosis import emulator_waves, extend
from diagnosis.bulk import Bulk
from diagnosis.design import BASE, ENOUGH, LEARN, TRAIN, factor_share, inputs_of, plan, possible
from diagnosis.emulator import as_tests, train
from diagnosis.extend import within
from diagnosis.lever_laws import lever_laws, with_laws
from diagnosis.model import Emulated
from diagnosis.page.words import place
from diagnosis.rig import Rig
from diagnosis.settings import catalogue_of, parameters_of, settings_of, study_settings
from diagnosis.setup import MOST_RUNS, RUNS, Setup, completed
from diagnosis.stages import plan_runs
from diagnosis.verdict import extension, findings
from facts import refused

LEVELS = (0.8, 1.0, 1.25)
POURED = [k for k in QUANTITIES if experiments()[k].poured]


def study(kind, **more):
    """What is read of a study of an experiment in its default rig."""
    spec = parse_spec({"experiment": kind, "seed": 1, "particles": {"diameter_mm": 2.0}})
    run = RUN | {
        "particles": {"count": spec.particles.count, "diameter_mm": 2.0},
        "geometry": spec.geometry.model_dump(exclude_none=True),
    }
    data = {"name": "s", "factors": "f", "measurements": "m"}
    data |= {"tests": {"own": {"experiment": kind, "run": run}}}
    return Config.model_validate(data | more)


def rows_of(kind, lever=None, value=None, levels=LEVELS):
    """Readings at three levels of a lever, about what its default rig has."""
    spec = parse_spec({"experiment": kind, "seed": 1, "particles": {"diameter_mm": 2.0}})
    needed = [n for n, lever in levers_of(kind).items() if lever.needed]
    lever = lever or (needed or ["particle_diameter_mm"])[0]
    part, key = LEVERS[lever].place
    middle = getattr(getattr(spec, part), key)
    fixed = {n: getattr(getattr(spec, LEVERS[n].place[0]), LEVERS[n].place[1]) for n in needed}
    value = value or (lambda level: 0.5 * middle * level)
    return [
        Measurement(kind, value(s), 0.02 * value(s), 5, fixed | {lever: middle * s}, "", 2 + k)
        for k, s in enumerate(levels)
    ]


def table_of(rows, path):
    """The rows as a user's table."""
    kinds = list(dict.fromkeys(name for m in rows for name in m.levers))
    lines = [",".join(["experiment,quantity,value,unit,sd,n", *kinds])]
    for m in rows:
        quantity = QUANTITIES[m.experiment]
        usual = {"kg/m³": 800.0, "deg": 30.0}.get(quantity.unit, rows[0].value)
        value = usual * m.value / rows[0].value
        given = [f"{m.levers[k]:.6g}" if k in m.levers else "" for k in kinds]
        first = [m.experiment, quantity.name, f"{value:.6g}", quantity.unit]
        lines.append(",".join([*first, f"{0.02 * value:.6g}", str(m.n), *given]))
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def setup_of(kind, rows, folder, **own):
    """`Setup` of a study of an experiment whose table has the rows."""
    config = study(kind, measurements=table_of(rows, folder / "m.csv"), factors=FACTORS)
    return Setup(SimpleNamespace(config=config), settings_of(own))


@pytest.mark.parametrize("kind", QUANTITIES)
def test_every_experiment_has_its_plan_and_says_its_budget_before_any_run(kind, tmp_path, capfd):
    rows = rows_of(kind, levels=(0.8, 0.85, 0.9, 0.95, 1.0))
    own = setup_of(kind, rows, tmp_path)
    assert completed(own.settings, None, read_factors(FACTORS), rows, "m.csv") == own.settings
    files = {k: str(tmp_path / f"{k}.json") for k in ("design", "plan")}
    plan_runs(own, SimpleNamespace(**files))
    specs = json.loads(Path(files["plan"]).read_text())
    written = yaml.safe_load((tmp_path / "settings.yaml").read_text())
    assert study_settings(Config.model_validate(own.config.model_dump() | written)) == own.settings
    said = capfd.readouterr().err
    if kind in POURED:
        runs = own.settings.runs
        assert RUNS <= runs <= MOST_RUNS
        assert 0 < len(specs) <= TRAIN * runs
        assert f"at most {runs} runs" in said
    else:
        assert specs == {}
    assert all(parse_spec(spec).experiment == kind for spec in specs.values())


@pytest.mark.parametrize("kind", QUANTITIES)
def test_a_setting_that_cannot_be_run_is_refused_by_its_line_before_any_run(kind, tmp_path):
    """Grains that are a hundred times as large fit no rig of the laboratory."""
    rows = rows_of(kind, "particle_diameter_mm", levels=(1.0, 1.05, 1.1, 100.0))
    if kind not in POURED:  # a single grain has no rig that it fills
        rows = [*rows[:3], replace(rows[3], levers=rows[3].levers | {"scale_factor": 0.0})]
    with pytest.raises(ConfigError) as caught:
        setup_of(kind, rows, tmp_path)
    assert "line 5" in str(caught.value)


def test_corners_that_nobody_measured_need_not_be_possible(tmp_path):
    """Grains of 2.4 mm need an orifice of 12 mm: the corner at 10 mm is left out, the plan stands.
    Where most of the points cannot be run the plan is refused."""
    sizes = {10.0: 1.5, 11.0: 1.7, 12.0: 2.0, 14.0: 2.4, 16.0: 2.4}
    rows = [
        Measurement(
            "discharge", 10.0 + o, 0.2, 5, {"orifice_diameter_mm": o, "particle_diameter_mm": d},
            "", 2 + k,
        )
        for k, (o, d) in enumerate(sizes.items())
    ]  # fmt: skip
    own = setup_of("discharge", rows, tmp_path)
    found, specs = plan(own.rig, own.catalogue, ["discharge"])
    base = [n for r in found if r["mechanism"] == BASE for n in r["run_ids"]]
    assert len(base) >= 0.5 * len(specs)
    for spec in specs.values():
        parse_spec(spec)
    narrow = own.settings.experiments["discharge"].model_copy(
        update={
            "levers": {"orifice_diameter_mm": [5.0, 10.0], "particle_diameter_mm": [1.9, 2.4]},
            "levels": {},
        }
    )
    settings = own.settings.model_copy(update={"experiments": {"discharge": narrow}})
    with pytest.raises(ConfigError) as caught:
        plan(replace(own.rig, settings=settings), own.catalogue, ["discharge"])
    assert "orifice_diameter_mm" in str(caught.value)


def test_an_experiment_without_a_rig_is_named_by_its_line():
    rows = [*rows_of("heap"), *rows_of("discharge")]
    place = {"path": "m.csv", "line": 2, "column": "experiment"}
    with refused(ConfigError, "discharge", "tests", "experiment: discharge", **place):
        completed(settings_of({}), study("heap"), read_factors(FACTORS), rows, "m.csv")


@pytest.mark.parametrize("code", ["dem", "liggghts", "lammps"])
def test_a_mechanism_whose_range_leaves_another_code_s_law_is_not_tried_there(code):
    """LIGGGHTS takes no rolling spring as soft as the softest of the range; the middle it takes."""
    settings, factors, known = bench_settings(200)
    engine = {} if code == "dem" else {"engine": {"name": code, "identity": {}, "settings": {}}}
    base = RUN | {"laws": {"rolling": "elastic_plastic"}} | engine
    rig = Rig(settings, base, tuple(factors))
    tried = dict.fromkeys(name for _, name in possible(rig, known, ["heap"]))
    assert ("rolling_law" in tried) == (code != "liggghts")
    assert "size_bias" in tried


def test_a_budget_of_time_is_as_many_runs_as_it_takes():
    """Twice the time is twice the runs; forty times as many grains take longer."""
    rows, factors = rows_of("heap"), read_factors(FACTORS)

    def runs(given, count):
        config = study("heap").model_dump()
        run = config["tests"]["own"]["run"]
        run["particles"]["count"], run["numerics"] = count, {"max_time_s": 100.0}
        config = Config.model_validate(config)
        return completed(settings_of(given), config, factors, rows, "m.csv").runs

    one, two = (runs({"minutes": m}, 2_000) for m in (2.0, 4.0))
    assert 0 <= two - 2 * one <= 1
    assert runs({"minutes": 2.0}, 80_000) < one / 20
    assert runs({}, 2_000) == MOST_RUNS
    assert runs({"minutes": 60.0}, 80_000) < RUNS == runs({}, 80_000)


def test_a_budget_is_given_once():
    rows = rows_of("heap")
    with refused(ConfigError, "minutes", "runs", key="diagnosis.minutes"):
        settings = settings_of({"runs": 80, "minutes": 10})
        completed(settings, study("heap"), read_factors(FACTORS), rows, "m.csv")


@pytest.mark.parametrize("runs", [60, 80, 200])
def test_a_budget_is_kept(runs):
    settings, factors, known = bench_settings(runs)
    _, specs = plan(Rig(settings, RUN, tuple(factors)), known, ["heap"])
    assert len(specs) <= TRAIN * runs
    for refined in (0, 10):
        left = runs - len(specs) - refined
        each, places = within(left, 2, rows_of("heap") * 5, 3)
        assert 2 * each * len(places) <= left
        assert len(specs) + refined + 2 * each * len(places) <= runs


def test_a_budget_that_is_too_small_says_what_is_enough():
    settings, factors, known = bench_settings(30)
    with pytest.raises(ConfigError) as caught:
        plan(Rig(settings, RUN, tuple(factors)), known, ["heap"])
    least = int(str(caught.value).split("at least ")[1].split(" runs")[0])
    settings, _, _ = bench_settings(least)
    plan(Rig(settings, RUN, tuple(factors)), known, ["heap"])


def known_of(bench):
    """The catalogue without free laws."""
    return {n: m for n, m in bench.catalogue.items() if m.source != "a free law"}


def own_runs(rows):
    """{mechanism: its runs} of rows of a design."""
    out = {}
    for row in rows:
        out[row["mechanism"]] = out.get(row["mechanism"], 0) + len(row["run_ids"])
    return out


@pytest.mark.parametrize("runs", [80, 240])
def test_mechanisms_have_as_many_runs_as_the_base_model_whatever_the_budget(runs):
    settings, factors, known = bench_settings(runs)
    found = own_runs(plan(Rig(settings, RUN, tuple(factors)), known, ["heap"])[0])
    base = found.pop(BASE)
    inputs = len(inputs_of(settings, factors, "heap", BASE))
    whole = min(TRAIN * runs, 2 * ENOUGH * inputs)
    assert set(found.values()) == {int(0.5 * whole / len(found))}
    assert base + sum(found.values()) == whole
    assert base - sum(found.values()) < len(found)


@pytest.mark.parametrize(("runs", "most"), [(80, 1), (240, 3)])
def test_a_wave_goes_to_the_base_model_and_to_what_the_rest_is_enough_for(runs, most):
    """Grains attract each other: the base model is run at its own best point nevertheless."""
    bench, _ = emulated(runs, scatter=2.0)
    rig = Rig(bench.settings, RUN, tuple(bench.factors))
    measured = heaps(lambda d: 30.0 + 25.0 / d)
    first = sum(own_runs(plan(rig, known_of(bench), ["heap"])[0]).values())
    rows, _, found = emulator_waves.plan_wave(Bulk(bench, measured), rig, 1, first)
    made = own_runs(rows)
    share = (LEARN * runs - first) / 2
    assert made.pop(BASE) == int(share / 2)
    assert len(made) == most
    assert sum(made.values()) <= share / 2
    _, fitted = emulator_waves.modes(Bulk(bench, measured))[BASE]
    at = factor_share(fitted.theta[0])
    inputs = np.array([r["inputs"] for r in rows if r["mechanism"] == BASE])
    assert np.abs(np.median(inputs[:, : len(at)], axis=0) - at).max() < 0.15
    assert not any(r["enough"] for r in found)


def refined(measured, runs=240, scatter=2.0):
    """`Found` of heaps, the emulators refined by two waves of runs that scatter [deg]."""
    bench, laws = emulated(runs, scatter)
    rig = Rig(bench.settings, RUN, tuple(bench.factors))
    rows, specs = plan(rig, known_of(bench), ["heap"])
    first = len(specs)
    for wave in (1, 2):
        more, own, _ = emulator_waves.plan_wave(Bulk(bench, measured), rig, wave, first)
        rows, specs = rows + more, specs | own
        answer = scattered(scatter)
        metrics = {n: answer(s) for n, s in specs.items()}
        emulators, _ = train(rows, metrics, rig, bench.catalogue)
        emulators = with_laws(emulators, bench.settings, bench.factors, laws)
        bench = Emulated(emulators, bench.settings, bench.factors, bench.catalogue)
    return Bulk(bench, measured).judged()


def test_an_attraction_is_found_and_none_is_none_by_one_rule():
    """Runs scatter by five times the readings' error; the attraction makes 6 degrees between the
    smallest and the largest grains."""
    assert refined(heaps(lambda d: 36.0)).verdict == "adequate"
    found = refined(heaps(lambda d: 30.0 + 27.0 / d))
    assert found.verdict != "adequate"
    assert found.p < 0.05
    assert found.ranking[0]["mechanism"] in ("cohesion", "liquid_bridge")


def bench_settings(runs):
    """Settings, factors and catalogue of heaps over the grain's size within a budget."""
    rows = rows_of("heap")
    settings = completed(
        settings_of({"runs": runs}), study("heap"), read_factors(FACTORS), rows, "m.csv"
    )
    return settings, parameters_of(settings, FACTORS, ["heap"]), catalogue_of(settings, ["heap"])


def emulated(runs=80, scatter=0.5):
    """`Emulated` of heaps, trained within a budget by the closed form and a scatter [deg]."""
    settings, factors, known = bench_settings(runs)
    own = trained(Rig(settings, RUN, tuple(factors)), known, ["heap"], scattered(scatter))
    laws = lever_laws(settings, factors, rows_of("heap"))
    emulators = with_laws(own.emulators, settings, factors, laws)
    return Emulated(emulators, settings, factors, known | laws), laws


def scattered(scatter):
    """The closed form of heaps, its angle with a scatter [deg]."""
    rng = np.random.default_rng(1)

    def metrics(spec):
        angle = closed_form(spec)["angle_of_repose_deg"] + scatter * rng.standard_normal()
        return {"angle_of_repose_deg": angle}

    return metrics


def heaps(angle, sizes=(1.6, 1.75, 1.9, 2.1, 2.3, 2.5), sd=0.4):
    """Readings of the angle [deg], a function of the diameter [mm]."""
    rng = np.random.default_rng(2)
    return [
        Measurement(
            "heap", angle(d) + sd / math.sqrt(5) * rng.standard_normal(), sd, 5,
            {"particle_diameter_mm": d}, "", 2 + k,
        )
        for k, d in enumerate(sizes)
    ]  # fmt: skip


def test_few_runs_tell_a_law_along_a_lever_from_none():
    """The closed form gives 50 degrees for each 1 of rolling friction; between 1.6 and 2.5 mm the
    law changes it by 0.15 in all. The same heaps without it are adequate."""
    bench, _ = emulated()
    assert Bulk(bench, heaps(lambda d: 38.0)).judged().verdict == "adequate"
    bulk = Bulk(bench, heaps(lambda d: 38.0 + 7.5 * math.log(d / 2) / 0.45))
    found = bulk.judged()
    assert found.verdict in ("discovered", "ambiguous")
    said = findings(bulk, found, extension(bulk, found), 0.05)
    told = [law | {"words": place(law)} for law in said["laws"]]
    near = [r for law in told for r in (law, *law["rivals"])]
    assert "rolling friction of size" in {r["words"] for r in near}
    assert not told[0]["names"]  # a free law is a place and no name
    assert "1.6 to 2.5 mm" in told[0]["sentence"]


def test_a_single_heap_at_odds_is_named_by_its_line():
    """Line 5 stands 6 degrees too steep, where a heap is known to 0.2; without it nothing is."""
    bench, _ = emulated(scatter=0.1)
    found = Bulk(bench, heaps(lambda d: 38.0 + 6.0 * (d == 2.1))).judged()
    assert found.verdict == "error"
    [row] = found.rows
    assert row["line"] == 5
    assert row["standard_deviations"] > 3.0
    assert row["expected"] == pytest.approx(38.0, abs=1.0)
    assert Bulk(bench, heaps(lambda d: 38.0)).judged().rows == []


def test_a_zigzag_from_size_to_size_is_an_error_of_each_setting():
    """Three degrees up and down, where a heap is known to 0.2: no line is at odds with the rest."""
    bench, _ = emulated(scatter=0.1)
    off = dict(zip((1.6, 1.75, 1.9, 2.1, 2.3, 2.5), (3, -3, 3, -3, 3, -3), strict=True))
    found = Bulk(bench, heaps(lambda d: 38.0 + off[d])).judged()
    assert found.verdict == "error"
    assert found.rows == []
    [error] = found.errors
    assert error["of"] == "settings"
    assert 1.5 < 38.0 * error["sd"] < 6.0


def beverloo(spec):
    """Mass flow [g/s] of a run spec (a mapping) by Beverloo's law, less where the grains roll
    worse; None, a clogged orifice, below 4.8 diameters and more where the grains roll worse."""
    d = spec["particles"]["diameter_mm"] * spec["particles"].get("scale_factor", 1.0)
    orifice = spec["geometry"]["orifice_diameter_mm"]
    rolling = spec["contacts"]["particle_particle"]["rolling_friction"]
    if orifice < (4.8 + rolling) * d:
        return None
    length = 1e-3 * (orifice - 1.4 * d)
    flow = 1e3 * 0.58 * 750.0 * math.sqrt(9.81) * length**2.5
    cohesion = spec.get("law_parameters", {}).get("surface_energy_J_m2", 0.0)
    return {"mass_flow_g_s": flow * (1.0 - 0.5 * rolling) / (1.0 + 2.0 * cohesion / d)}


def discharges(change, orifices=(10.0, 11.0, 12.0, 13.0, 14.0, 15.0), clogged=0):
    """Readings over the orifice of grains of 2 mm whose rolling friction is 0.2 and a change, a
    function of the orifice; and tests at the narrowest that clogged."""
    rows = []
    for k, orifice in enumerate(orifices):
        spec = {
            "particles": {"diameter_mm": 2.0},
            "geometry": {"orifice_diameter_mm": orifice},
            "contacts": {"particle_particle": {"rolling_friction": 0.2 + change(orifice)}},
        }
        value = beverloo(spec)["mass_flow_g_s"]
        rows.append(
            Measurement(
                "discharge", value, 0.01 * value, 5, {"orifice_diameter_mm": orifice}, "", 2 + k
            )
        )
    if clogged:
        at = {"orifice_diameter_mm": orifices[0]}
        rows.append(
            Measurement("discharge", math.nan, math.nan, clogged, at, "", 20, outcome="clogged")
        )
    return rows


def silo(rows):
    """`Emulated` of discharges in a silo of 40 mm, trained within a budget by `beverloo`."""
    config, factors = study("discharge"), read_factors(FACTORS)
    settings = completed(settings_of({}), config, factors, rows, "m.csv")
    known = catalogue_of(settings, ["discharge"])
    factors = parameters_of(settings, FACTORS, ["discharge"])
    rig = Rig(settings, config.own_run | {"experiment": "discharge"}, tuple(factors))
    own = trained(rig, known, ["discharge"], beverloo)
    valued = [m for m in rows if not m.outcome]
    laws = lever_laws(settings, factors, valued)
    emulators = with_laws(own.emulators, settings, factors, laws)
    failures = with_laws(own.failures, settings, factors, laws)
    return Emulated(emulators, settings, factors, known | laws, failures)


@pytest.mark.parametrize("clogged", [0, 4])
def test_a_silo_that_arches_late_is_a_clogged_test_where_the_table_has_some(clogged):
    """Its run reads the flow of what had left before."""
    rows = discharges(lambda orifice: 0.0, clogged=clogged)
    settings = completed(settings_of({}), study("discharge"), read_factors(FACTORS), rows, "m.csv")
    specs = {n: {"experiment": "discharge"} for n in ("free", "arched", "failed")}
    flow = {"mass_flow_g_s": 3.0}
    metrics = {"free": flow | {"arched": 0}, "arched": flow | {"arched": 1}, "failed": None}
    found = as_tests(settings, specs, metrics)
    assert [n for n, m in found.items() if m is None] == ["arched"] * bool(clogged) + ["failed"]
    assert found["free"] == metrics["free"]


def test_settings_that_a_law_makes_impossible_are_left_out_of_waves_and_gain(monkeypatch):
    """Grains that are 1.3 times as large need more than 13 mm; the table begins at 10 mm."""
    rows = discharges(lambda orifice: 0.0)
    bench = silo(rows)
    model = bench.model([m.condition for m in rows], ["size_bias"])
    rig = Rig(
        bench.settings, study("discharge").run | {"experiment": "discharge"}, tuple(bench.factors)
    )
    theta = np.array([*np.zeros(len(model.factors)), 1.0])
    sd, cov = np.full((1, len(rows)), 10.0), 1e-9 * np.eye(len(theta))[None]
    fitted = SimpleNamespace(theta=theta[None], cov=cov, sd=sd)
    near, specs = emulator_waves._near(rig, "discharge", model, fitted, 1, 12)
    assert 0 < len(near) == len(specs) < 12
    without = SimpleNamespace(theta=np.tile(theta, (len(rows), 1)))
    monkeypatch.setattr(extend, "held_out_fits", lambda model, data: without)
    monkeypatch.setattr(extend, "refit_errors", lambda model, data, fits: np.zeros(len(rows)))
    models = {"before": bench.model([m.condition for m in rows]), "after": model}
    found, specs = extend.extension_plan(rig, models, rows, None)
    wide = [k for k, m in enumerate(rows) if m.levers["orifice_diameter_mm"] > 13.0]
    for label in models:
        assert [r["setting"] for r in found if r["label"] == label] == wide
    assert set(specs) == {name for r in found for name in r["run_ids"]}
