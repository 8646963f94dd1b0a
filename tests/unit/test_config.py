"""A wrong configuration is refused before any run starts, with file, key, value and what is
allowed."""

from pathlib import Path

import pytest
import yaml

from calibration.errors import ConfigError
from calibration.runs.feasibility import check_ahead
from calibration.runs.plans import plan, run_id
from calibration.statistics.design import box_behnken, steepest_path
from calibration.study.config import Config, given, overlay, parse_config, section_of
from calibration.study.factors import Factor, factor_of, read_factors
from facts import refused

ROOT = Path(__file__).parents[2]


@pytest.fixture
def data(monkeypatch):
    monkeypatch.chdir(ROOT)
    return yaml.safe_load((ROOT / "config" / "config.yaml").read_text())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"nam": "x"}, ["nam", "name"]),
        ({"name": "a b"}, ["name", "a b", "letters"]),
        ({"seed": -1}, ["seed", "-1"]),
        ({"screening": {"alpha": 2}}, ["screening.alpha", "2", "less than 1"]),
        ({"screening": {"alfa": 0.1}}, ["screening.alfa", "alpha"]),
        (
            {"fixed": {"salt_stel_restitution": 0.4}},
            ["fixed.salt_stel_restitution", "salt_steel_restitution"],
        ),
        ({"ascent": {"step": {"nobody": 1}}}, ["ascent.step.nobody"]),
        (
            {"response_surface": {"half_width": {"salt_salt_restitution": 0}}},
            ["half_width", "greater than 0"],
        ),
        ({"optimise": {"rule": "best"}}, ["optimise.rule", "closest_to_centre"]),
        (
            {"optimise": {"candidate_half_width": 0.5, "candidate_at_most": 5}},
            ["optimise.candidate_at_most", "5", "10 (candidate_runs) or more"],
        ),
        ({"optimise": {"candidate_half_width": 0}}, ["candidate_half_width", "greater than 0"]),
        ({"optimise": {"rule": "closest_to_point"}}, ["optimise.point", "a level"]),
        ({"optimise": {"point": {"salt_salt_restitution": 0.5}}}, ["optimise.point"]),
        ({"optimise": {"point": {"nobody": 0.5}}}, ["optimise.point.nobody"]),
        ({"measurements": "nowhere.csv"}, ["nowhere.csv", "cannot be read"]),
        ({"target": {"column": "angle"}}, ["target.column", "a row a reading", "`measurements`"]),
        ({"bench": {"tilt": {"measured": 35.0}}}, ["bench.tilt.measured", "`measurements`"]),
        ({"reproduction": {"beside": []}}, ["reproduction", "not valid", "screening"]),
        ({"factors": "nowhere.tsv"}, ["nowhere.tsv"]),
        ({"run": {"particles": {"cuont": 5}}}, ["particles.cuont", "count"]),
        ({"run": {"particles": {"count": 10, "diameter_mm": 9.0}}}, ["orifice_diameter_mm"]),
        ({"run": {"laws": {"cohesion": "sjkr"}}}, ["cohesion_energy_density_J_m3"]),
    ],
)
def test_a_wrong_configuration_is_refused(data, change, words):
    with pytest.raises(ConfigError) as error:
        parse_config(data | change, file="config.yaml")
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("change", "file", "line"),
    [
        ("validation:\n  alpha: 2\n", "mine.yaml", 3),
        ("validation: { margin: 1.0, replicate: 3 }\n", "mine.yaml", 2),
        ("run:\n  particles:\n    cuont: 5\n", "mine.yaml", 4),
        ("ascent:\n  start: { nobody: 1 }\n", "mine.yaml", 3),
        ("further_targets:\n  - { metric: heigth_mm, low: 1, high: 2 }\n", "mine.yaml", 2),
    ],
)
def test_an_error_names_the_file_and_the_line(data, tmp_path, change, file, line):
    mine = tmp_path / file
    mine.write_text(f"# my own changes\n{change}")
    merged = overlay(data, yaml.safe_load(mine.read_text()))
    with pytest.raises(ConfigError) as error:
        parse_config(merged, files=["config/config.yaml", mine])
    assert f"{mine}, line {line}: " in str(error.value)


def test_an_error_in_the_file_below_names_that_one(data, tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("seed: 3\n")
    below = tmp_path / "below.yaml"
    below.write_text("name: x\nscreening: { alpha: 7 }\n")
    merged = overlay(data, {"seed": 3, "screening": {"alpha": 7}})
    with refused(
        ConfigError,
        path="below.yaml",
        line=2,
        key="screening.alpha",
        value=7,
        allowed="less than 1",
    ):
        parse_config(merged, files=[below, mine])


def test_an_error_on_the_command_line_blames_no_file(data):
    with refused(
        ConfigError, path="--config", key="seed", value=-1, allowed="greater than or equal to 0"
    ):
        parse_config(data | {"seed": -1}, files=["config/config.yaml"])


@pytest.mark.parametrize("key", ["name", "factors", "target", "measurements"])
def test_what_every_stage_needs_has_no_default(data, key):
    *path, last = key.split(".")
    part = data
    for name in path:
        part = part[name]
    del part[last]
    with refused(ConfigError, path="configuration", key=key, value=None):
        parse_config(data)


@pytest.mark.parametrize("test", ["tilt", "drop", "shear"])
def test_bench_tests_that_the_heaps_wait_for_must_be_described(data, test):
    del data["bench"][test]
    assert getattr(parse_config(data).bench, test) is None
    with refused(ConfigError, "fixed_from", "bench", key=f"bench.{test}", value=None):
        parse_config(data | {"fixed_from": "bench"})


def defaults(schema):
    """Every default of a schema that is a number other than a count, a share or a level."""
    for name, field in schema.model_fields.items():
        part = section_of(field.annotation)
        if part:
            yield from ((f"{name}.{key}", value) for key, value in defaults(part))
        else:
            yield name, field.get_default(call_default_factory=True)


def test_no_value_of_the_salt_and_none_of_its_files_is_a_default(data):
    """The words and numbers of the salt's own configuration, but for those of procedure."""
    found = dict(defaults(Config))
    measured = {35.82, 20.5, 0.845, 0.084, 0.04, 0.85, "salt"}
    for key, value in found.items():
        items = value if isinstance(value, list) else [value]
        assert not measured & {v for v in items if isinstance(v, str | float)}, key
        assert not any("salt" in v or "/" in v for v in items if isinstance(v, str)), key


@pytest.mark.parametrize("stage", ["tilt", "drop", "shear", "scaling"])
def test_a_stage_without_its_section_names_stage_and_key(stage, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    config = parse_config(yaml.safe_load(Path("examples/soybean/config.yaml").read_text()))
    key = "scaling" if stage == "scaling" else f"bench.{stage}"
    with refused(ConfigError, stage, key=key, value=None):
        given(config, key, stage)


def test_a_factor_is_found_by_the_key_it_sets():
    factors = read_factors(ROOT / "examples" / "soybean" / "factors.tsv")
    key = "contacts.particle_wall.static_friction"
    assert factor_of(factors, key).name == "bean_steel_static_friction"
    with refused(
        ConfigError,
        key="contacts.particle_wall.restitution",
        allowed="contacts.particle_wall.static_friction",
    ):
        factor_of(factors[1:2], "contacts.particle_wall.restitution")


@pytest.mark.parametrize(
    ("key", "low", "words"),
    [
        ("contacts.particle_particle.restituton", 0.2, ["restituton", "restitution"]),
        ("contacts.particle_particle.restitution", 0.0, ["column low", "cannot be 0", "0.03"]),
    ],
)
def test_a_factor_that_the_run_spec_refuses_is_named(data, tmp_path, key, low, words):
    path = tmp_path / "factors.tsv"
    path.write_text(f"code\tname\tkey\tlow\thigh\nA\tx\t{key}\t{low}\t0.5\n")
    study = {key: data[key] for key in ("run", "target", "measurements")}
    study |= {"name": "x", "factors": str(path)}
    with pytest.raises(ConfigError) as error:
        parse_config(study)
    for word in [str(path), "x", *words]:
        assert word in str(error.value)


@pytest.mark.parametrize("name", ["=cmd|calc", "+1", "@sum", "-x", "x;=1", "x/y", "1x", 'a"b'])
@pytest.mark.parametrize("column", ["code", "name"])
def test_a_factor_whose_name_a_spreadsheet_would_compute_is_refused(tmp_path, column, name):
    row = {"code": "A", "name": "x", "key": "contacts.particle_wall.restitution"}
    row |= {"low": "0.4", "high": "0.6"}
    path = tmp_path / "factors.tsv"
    path.write_text("\t".join(row) + "\n" + "\t".join((row | {column: name}).values()) + "\n")
    with refused(ConfigError, str(path), "line 2", column, name):
        read_factors(path)


def factors(k):
    return [Factor(chr(65 + i), f"f{i}", f"k{i}", 0.0, 1.0) for i in range(k)]


def test_equal_points_share_a_run_and_replicates_do_not(data):
    config, table = parse_config(data), read_factors("config/factors.tsv")
    chosen = [f for f in table if f.code in "CEG"]
    design = box_behnken(chosen, centre_runs=5)
    planned, specs = plan(design, table, config)
    assert planned["run_id"].is_unique
    assert len(specs) == 17
    centre = {f.name: f.centre for f in chosen}
    path = steepest_path(chosen, centre, {f.name: 0.0 for f in chosen}, 1)
    shared, _ = plan(path, table, config)
    assert shared["run_id"][0] in set(planned["run_id"])


def test_moving_one_point_changes_one_run(data):
    config, table = parse_config(data), read_factors("config/factors.tsv")
    chosen = [f for f in table if f.code in "CEG"]
    before, _ = plan(box_behnken(chosen), table, config)
    moved = box_behnken(chosen)
    moved.loc[0, chosen[0].name] += 0.01
    after, _ = plan(moved, table, config)
    assert (before["run_id"] != after["run_id"]).sum() == 1


def test_what_a_run_writes_does_not_rename_it(data):
    config = parse_config(data)
    spec = {**config.run, "experiment": "heap", "seed": 1}
    assert run_id(spec) == run_id(spec | {"output": {"frame_interval_s": 0.1}})
    assert run_id(spec) != run_id(spec | {"seed": 2})


def test_a_number_of_the_material_that_nothing_gives_is_refused_before_any_run(data):
    check_ahead(parse_config(data))
    del data["run"]["materials"]["particle"]["density_kg_m3"]
    with refused(ConfigError, "fixed", key="materials.particle.density_kg_m3"):
        check_ahead(parse_config(data))


@pytest.mark.parametrize("place", ["run", "bench.tilt.run", "bench.shear.run", "scaling.heap"])
def test_the_size_of_the_grains_is_no_default(data, place):
    section = data
    for name in place.split("."):
        section = section[name]
    del section["particles"]["diameter_mm"]
    with refused(ConfigError, key="particles.diameter_mm"):
        check_ahead(parse_config(data))


def test_a_factor_without_a_level_while_it_is_not_varied_is_refused_before_any_run(data):
    check_ahead(parse_config(data))
    del data["fixed"]["salt_salt_restitution"]
    with refused(
        ConfigError, key="fixed.salt_salt_restitution", allowed="a level of it: 0.15 to 0.75"
    ):
        check_ahead(parse_config(data))
    data["run"]["contacts"] = {"particle_particle": {"restitution": 0.5}}
    check_ahead(parse_config(data))
