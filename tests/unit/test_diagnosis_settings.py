"""Settings of the diagnosis: laid over by a study, checked against the measurements, extended by a
folder."""

from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from diagnosis_cases import BASE as RUN

from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement, MeasurementErrors
from calibration.intake.quantities import Condition
from diagnosis.design import inputs_of, plan
from diagnosis.rig import Rig
from diagnosis.settings import (
    catalogue_of,
    check_levers,
    parameters_of,
    read_settings,
    study_settings,
    widened,
)
from diagnosis.setup import Setup
from facts import refused

FILE = "config/diagnosis.yaml"


def drop(height, line, **levers):
    return Measurement("drop", 0.2 * height, 1.0, 5, {"drop_height_mm": height, **levers}, "", line)


def test_changes_are_laid_over_key_by_key_and_a_null_takes_one_away():
    plain = read_settings(FILE)
    changed = read_settings(
        FILE,
        {
            "experiments": {
                "shear": {"runs_per_input": 4},
                "drop": {"levers": {"particle_diameter_mm": None}},
            }
        },
    )
    assert changed.experiments["shear"].runs_per_input == 4
    assert changed.experiments["shear"].run == plain.experiments["shear"].run
    assert list(changed.experiments["drop"].levers) == ["drop_height_mm"]


@pytest.mark.parametrize(
    ("changes", "names", "facts"),
    [
        ({"runs_per_input": 1}, [], {"key": "runs_per_input", "value": 1}),
        (
            {"experiments": {"drop": {"levers": {"colour": [1, 2]}}}},
            ["levers.colour"],
            {"key": "experiments.drop"},
        ),
        (
            {"experiments": {"drop": {"levers": {"drop_height_mm": [2, 1]}}}},
            ["0 < low < high"],
            {"key": "experiments.drop"},
        ),
        (
            {"experiments": {"tilt": {"held": {"tilt_rate_deg_s": 5}}}},
            ["held.tilt_rate_deg_s"],
            {"key": "experiments.tilt"},
        ),
        ({"speed": 3}, [], {"key": "speed", "value": 3}),
    ],
)
def test_a_bad_setting_is_named(changes, names, facts):
    with refused(ConfigError, *names, path="diagnosis.yaml", **facts):
        read_settings(FILE, changes)


def test_levers_that_the_emulators_hold_are_named_each_with_line_and_column():
    settings = read_settings(FILE)
    rows = [
        drop(10.0, 3),
        drop(100.0, 4, particle_diameter_mm=9.0),
        drop(100.0, 5, scale_factor=2.0),
        drop(100.0, 6, output_interval_s=0.01),
        Measurement("shear", 1.0, 0.1, 5, {"particle_diameter_mm": 3.0}, "", 7),
    ]
    with pytest.raises(MeasurementErrors) as caught:
        check_levers(settings, rows, "m.csv")
    lines = str(caught.value).splitlines()
    wanted = ["5, column scale", "7, column particle_dia"]
    assert len(lines) == len(wanted)
    for line, where in zip(lines, wanted, strict=True):
        assert line.startswith(f"m.csv, line {where}")
    assert "allowed: empty or 2" in lines[1]


def test_the_ranges_of_the_levers_are_as_wide_as_the_measurements():
    settings = read_settings(FILE)
    before, load = (settings.experiments[e].levers for e in ("drop", "shear"))
    rows = [drop(10.0, 3), drop(700.0, 4), drop(100.0, 5, particle_diameter_mm=9.0)]
    after = widened(settings, rows).experiments
    assert after["drop"].levers["drop_height_mm"] == [10.0, 700.0]
    assert after["drop"].levers["particle_diameter_mm"] == [before["particle_diameter_mm"][0], 9.0]
    assert after["shear"].levers == load
    assert widened(settings, rows[2:2]).experiments == settings.experiments


def test_the_salt_s_study_names_its_file_and_lays_its_keys_over_it():
    own = yaml.safe_load(Path("config/config.yaml").read_text())["diagnosis"]
    assert study_settings(own) == read_settings(FILE)
    assert study_settings(own | {"seed": 9}) == read_settings(FILE, {"seed": 9})


@pytest.mark.parametrize(
    ("text", "names", "facts"),
    [
        ("seed: 3\ncatalogue: theirs\n", ["--config"], {"line": 2, "key": "catalogue"}),
        ("- seed\n", ["YAML"], {"line": None, "key": None}),
    ],
)
def test_a_file_of_settings_that_cannot_be_used_is_named(text, names, facts, tmp_path):
    (tmp_path / "own.yaml").write_text(text)
    with refused(ConfigError, *names, path="own.yaml", **facts):
        study_settings({"settings": str(tmp_path / "own.yaml")})
    with refused(ConfigError, key="diagnosis.settings", value=3):
        study_settings({"settings": 3})


def test_a_run_spec_that_the_engine_refuses_is_found_before_any_run():
    settings = read_settings(
        FILE, {"experiments": {"drop": {"run": {"numerics": {"rayleigh_fraction": 3.0}}}}}
    )
    with refused(
        ConfigError,
        "3",
        "drop_height_mm",
        "100",
        "numerics.rayleigh_fraction",
        "3.0",
        "0.8",
        key="experiments.drop.run",
    ):
        Rig(settings, {}).check([drop(100.0, 3)])


def test_the_heap_stands_in_the_rig_of_the_calibration():
    settings = read_settings(FILE)
    base = {"geometry": {"plate_diameter_mm": 60, "generation_rate_per_s": 1}}
    rig = Rig(settings, base)
    heap = rig.spec(Condition("heap", {"particle_diameter_mm": 1.6}), 1)
    assert heap["geometry"]["plate_diameter_mm"] == 60
    assert heap["geometry"]["generation_rate_per_s"] == 1250
    assert heap["particles"]["count"] == round(1250 * (2.0 / 1.6) ** 3)
    tilt = rig.spec(Condition("tilt", {}), 1)
    assert "plate_diameter_mm" not in tilt["geometry"]


def test_ranges_of_factors_can_be_replaced():
    name = "contacts.particle_wall.restitution"
    settings = read_settings(FILE, {"ranges": {name: [0.85, 0.99]}})
    [factor] = parameters_of(settings, "config/factors.tsv", ["drop"])
    assert (factor.low, factor.high) == (0.85, 0.99)
    with refused(ConfigError, path="factors.tsv", key="ranges", value="gold"):
        parameters_of(
            read_settings(FILE, {"ranges": {"gold": [0, 1]}}), "config/factors.tsv", ["drop"]
        )
    with refused(
        ConfigError, key="diagnosis.ranges.contacts.particle_wall.restitution", value=[1.0, 0.0]
    ):
        parameters_of(
            read_settings(FILE, {"ranges": {name: [1, 0]}}), "config/factors.tsv", ["drop"]
        )


@pytest.mark.parametrize("file", ["config/diagnosis.yaml", "benchmarks/rates/settings.yaml"])
def test_the_settings_are_of_no_study(file):
    """They find the factors of any study by the keys that these set, and name none."""
    settings, text = read_settings(file), Path(file).read_text()
    for table, first in (("config", "salt_steel"), ("examples/soybean", "bean_steel")):
        factors = parameters_of(settings, f"{table}/factors.tsv", list(settings.experiments))
        assert {f.name.rpartition("_")[0].rpartition("_")[0] for f in factors} > {first}
        assert not [f.name for f in factors if f.name in text]


@pytest.mark.parametrize(
    ("key", "value"),
    [("mechanisms", ["air_drag"]), ("denser", {"air_drag": 9}), ("repeated", {"air_drag": 2})],
)
def test_an_unknown_mechanism_is_named(key, value):
    settings = read_settings(FILE, {"experiments": {"tilt": {key: value}}})
    with refused(ConfigError, "wall_adhesion", key=f"experiments.tilt.{key}", value="air_drag"):
        catalogue_of(settings, ["tilt"])


def test_points_may_be_repeated_and_the_first_runs_are_those_of_one():
    planned = []
    for repeated in ({}, {"base": 3, "air_drag": 2}):
        changes = {"experiments": {"drop": {"repeated": repeated, "runs_per_input": 3}}}
        settings = read_settings("benchmarks/rates/settings.yaml", changes)
        factors = parameters_of(settings, "config/factors.tsv", ["drop"])
        planned.append(plan(Rig(settings, {}, factors), catalogue_of(settings, ["drop"]), ["drop"]))
    (once, few), (often, many) = planned
    assert [r["inputs"] for r in once] == [r["inputs"] for r in often]
    assert [r["run_ids"][0] for r in often] == [r["run_ids"][0] for r in once]
    numbers = {r["mechanism"]: len(r["run_ids"]) for r in often}
    assert (numbers.pop("base"), numbers.pop("air_drag"), set(numbers.values())) == (3, 2, {1})
    assert few.items() <= many.items()
    row = often[0]
    assert len({many[n]["seed"] for n in row["run_ids"]}) == 3


def test_a_mechanism_may_be_taught_by_more_runs_and_counts_are_whole():
    changes = {"experiments": {"drop": {"denser": {"air_drag": 9}, "runs_per_input": 3}}}
    settings = read_settings("benchmarks/rates/settings.yaml", changes)
    factors = parameters_of(settings, "config/factors.tsv", ["drop", "heap"])
    rows, specs = plan(
        Rig(settings, {}, factors), catalogue_of(settings, ["drop"]), ["drop", "heap"]
    )
    runs = Counter((r["experiment"], r["mechanism"]) for r in rows)
    assert runs["drop", "air_drag"] == 9 * 4
    assert runs["drop", "plastic_restitution"] == 3 * 4
    counts = [s["particles"]["count"] for s in specs.values() if s["experiment"] == "heap"]
    assert all(isinstance(c, int) and 400 <= c <= 1200 for c in counts)


def _planned(changes, mechanism="size_bias"):
    heap = {"runs_per_input": 3, "mechanisms": [mechanism]} | changes
    settings = read_settings("benchmarks/rates/settings.yaml", {"experiments": {"heap": heap}})
    factors = parameters_of(settings, "config/factors.tsv", ["heap"])
    known = catalogue_of(settings, ["heap"])
    rows, specs = plan(Rig(settings, {}, factors), known, ["heap"])
    return settings, factors, known, rows, specs


def test_runs_of_a_mechanism_that_multiplies_a_lever_are_runs_of_the_base_model():
    settings, factors, _, rows, specs = _planned({"hypercubes": None, "repeated": None})
    assert {r["mechanism"] for r in rows} == {"base"}
    low, high = settings.experiments["heap"].levers["particle_diameter_mm"]
    column = inputs_of(settings, factors, "heap", "base").index("particle_diameter_mm")
    biased = 0
    for row in rows:
        particles = specs[row["run_ids"][0]]["particles"]
        factor = particles.get("scale_factor", 1.0)
        biased += factor != 1.0
        stands_for = low * (high / low) ** row["inputs"][column]
        assert stands_for == pytest.approx(particles["diameter_mm"] * factor, rel=1e-4)
    assert biased == 3 * (len(rows[0]["inputs"]) + 1)


def test_a_mechanism_is_more_than_its_lever_where_the_number_of_grains_follows_from_their_size():
    levers = {"particle_count": None}
    _, _, _, rows, _ = _planned({"levers": levers, "hypercubes": None, "repeated": None})
    assert {r["mechanism"] for r in rows} == {"base", "size_bias"}


def test_a_table_beyond_the_ranges_is_read_as_it_is(tmp_path):
    """Shear tests at 0.5 and 12 kPa, where the settings have 0.8 to 9: nobody edits them."""
    rows = ["experiment,quantity,value,unit,sd,n,normal_stress_kPa"]
    rows += [f"shear,shear_stress,{0.8 * s},kPa,0.05,5,{s}" for s in (0.5, 2.0, 5.0, 12.0)]
    path = tmp_path / "loads.csv"
    path.write_text("\n".join(rows) + "\n")
    config = SimpleNamespace(
        experiment="heap", measurements=str(path), factors="config/factors.tsv", run=RUN
    )
    own = Setup(SimpleNamespace(config=config), read_settings(FILE))
    assert own.settings.experiments["shear"].levers == {"normal_stress_kPa": [0.5, 12.0]}
    assert own.rig.settings is own.settings
