"""Other engines behind a study's runs: names of runs, refusals, and what a program may do wrong."""

import importlib
import math
import re
import shutil
import sys
import textwrap
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from calibration import digests, engines
from calibration.engines.mesh import write_mesh
from calibration.engines.program import prime_seed, stated_version
from calibration.engines.rig import Drop, Pour
from calibration.engines.rigs import discharge as silo_of_other_codes
from calibration.intake.started_code import permit
from calibration.runs.plans import run_id
from calibration.runs.store import RunStore
from dem.constants import GRAVITY
from dem.errors import DemError
from dem.experiments.bed import shake
from dem.experiments.phases import look
from dem.grains.sizes import draw_radii
from dem.io.stl import read_stl
from dem.run import run
from dem.spec import content_hash, parse_spec
from facts import refused

OWN = {
    "experiment": "drop",
    "seed": 1,
    "materials": {
        "particle": {"density_kg_m3": 1200, "shear_modulus_Pa": 1e7, "poisson_ratio": 0.25},
        "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
    },
    "contacts": {
        "particle_particle": {"restitution": 0.5, "static_friction": 0.5, "rolling_friction": 0.1},
        "particle_wall": {"restitution": 0.6, "static_friction": 0.5, "rolling_friction": 0.1},
    },
    "laws": {"rolling": "none"},
    "particles": {"count": 1, "diameter_mm": 2.0},
}
FACTOR = "rolling_stiffness_factor"


def program(tmp_path, text, **settings):
    """Engine entry of a Python program with this text, which may be started, and its path."""
    path = tmp_path / "solver.py"
    path.write_text(textwrap.dedent(text))
    chosen = {
        "name": "command",
        "command": f"{sys.executable} {path} {{spec}} {{seed}}",
        "version": "1",
        "files": [str(path)],
    }
    permit(SimpleNamespace(engine=chosen, diagnosis={}))
    return engines.entry_of(chosen | settings), path


def simulate(entry, folder):
    folder.mkdir(exist_ok=True)
    return engines.engines()[entry["name"]].simulate(parse_spec(OWN), folder, entry)


CLOSED_FORM = """
import json, sys, yaml
spec = yaml.safe_load(open(sys.argv[1]))
e = spec["contacts"]["particle_wall"]["restitution"]
height = spec["geometry"]["drop_height_mm"]
metrics = {"rebound_height_mm": e * e * height, "seed": int(sys.argv[2])}
json.dump(metrics, open("metrics.json", "w"))
"""


def test_a_command_is_started_by_the_name_of_its_link(tmp_path, monkeypatch):
    """The Python of an environment is a link, and by its own name finds the environment."""
    monkeypatch.chdir(tmp_path)
    Path("real").write_text('#!/bin/sh\nn=$(basename "$0")\necho "{\\"$n\\": 1}" > metrics.json\n')
    Path("real").chmod(0o755)
    Path("linked").symlink_to("real")
    chosen = {"name": "command", "command": "./linked {spec}", "version": "1"}
    permit(SimpleNamespace(engine=chosen, diagnosis={}))
    metrics, _ = simulate(engines.entry_of(chosen), tmp_path / "run")
    assert metrics == {"linked": 1}


def test_engines_versions_and_files_never_share_a_run(tmp_path):
    entry, path = program(tmp_path, CLOSED_FORM)
    specs = [OWN, OWN | {"engine": entry}]
    specs.append(OWN | {"engine": program(tmp_path, CLOSED_FORM, version="2")[0]})
    path.write_text(path.read_text() + "\n# another program\n")
    chosen = entry["settings"] | {"name": "command"}
    specs.append(OWN | {"engine": engines.entry_of(chosen)})
    assert len({content_hash(parse_spec(s)) for s in specs}) == 4
    patient = OWN | {"engine": entry | {"settings": entry["settings"] | {"timeout_s": 9.0}}}
    assert content_hash(parse_spec(patient)) == content_hash(parse_spec(specs[1]))


def test_a_run_is_kept_with_its_manifest_and_made_once(tmp_path):
    entry, path = program(tmp_path, CLOSED_FORM)
    spec = OWN | {"engine": entry}
    folder = tmp_path / run_id(spec)
    first = engines.make(spec, folder)
    assert first["engine"] == "other: command"
    assert first["metrics"] == {"rebound_height_mm": pytest.approx(0.36 * 150.0), "seed": 1}
    assert RunStore(tmp_path).current(folder.name) == first
    path.unlink()  # the kept result is not made again
    assert engines.make(spec, folder, again=False) == first
    with refused(engines.EngineError, "solver.py", "engine.files"):
        engines.make(spec, folder)
    assert RunStore(tmp_path).current(folder.name) is None


def test_our_engine_refuses_a_run_of_another(tmp_path):
    with refused(DemError, "command"):
        run(parse_spec(OWN | {"engine": program(tmp_path, CLOSED_FORM)[0]}), tmp_path / "run")


def test_a_changed_row_of_a_table_is_told(tmp_path):
    table = tmp_path / "responses.csv"
    chosen = {"name": "table", "responses": str(table), "code": "EDEM 2024"}
    spec = OWN | {"engine": engines.entry_of(chosen)}
    name, store = run_id(spec), RunStore(tmp_path)
    table.write_text(f"run_id,rebound_height_mm\n{name},54.0\n")
    made = engines.make(spec, tmp_path / name)
    assert made["metrics"] == {"rebound_height_mm": 54.0}
    assert engines.changed(made["engine"], name, store) is None
    table.write_text(f"run_id,rebound_height_mm\n{name},55.0\n")
    assert "has changed" in engines.changed(made["engine"], name, store)


def test_our_own_engine_adds_nothing_to_a_spec():
    assert engines.entry_of("dem") is None
    assert engines.entry_of({"name": "dem"}) is None


@pytest.mark.parametrize("name", ["liggghts", "lammps", "yade"])
def test_what_a_code_cannot_represent_is_refused_by_name(name):
    """Other laws are those of the decks, see test_export.py."""
    spec = parse_spec(OWN | {"laws": {"rolling": "constant_torque"}})
    with refused(engines.EngineError, "constant_torque", "none", "elastic_plastic"):
        engines.engines()[name].refuse(spec)


def test_a_program_asked_for_its_version_leaves_no_file_where_one_works(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    logging = "from pathlib import Path; Path('log').touch(); print('Version 3 8')"
    assert stated_version([sys.executable, "-c", logging], r"Version (\S+)") == "3"
    assert not list(tmp_path.iterdir())


def test_seeds_are_primes_that_differ_and_fit_in_32_bits():
    seeds = [prime_seed(k) for k in (*range(50), *range(271_150, 271_190), 301_000, 2**31 - 1)]
    assert len(set(seeds)) == 92
    assert all(n > 10_000 and all(n % k for k in range(2, int(n**0.5) + 1)) for n in seeds)
    assert max(seeds) < 2**31


@pytest.mark.parametrize("seed", [1, 1000, 1004, 2000])
def test_no_two_seeds_of_a_heap_in_liggghts_are_the_same(tmp_path, seed):
    """It stops at a second one."""
    sizes = {"by": "mass", "diameters_mm": [1.8, 2.2], "fractions": [0.5, 0.5]}
    parts = {"particles": {"count": 100, "sizes": sizes}}
    _, text = deck_of("liggghts", tmp_path, experiment="heap", seed=seed, **parts)
    seeds = re.findall(r"(?:particletemplate/sphere|numberbased|region seed) (\d+)", text)
    assert len(seeds) == len(set(seeds)) >= 4


def test_a_rolling_spring_that_liggghts_has_not_is_refused():
    """It asks for a rollingStiffness of 1 at least, which is 2/3 of ours."""
    rolls = OWN | {"laws": {"rolling": "elastic_plastic"}}
    soft, stiff = (parse_spec(rolls | {"law_parameters": {FACTOR: f}}) for f in (0.66, 0.67))
    with refused(engines.EngineError, f"law_parameters.{FACTOR}", "0.66"):
        engines.engines()["liggghts"].refuse(soft)
    engines.engines()["liggghts"].refuse(stiff)
    engines.engines()["lammps"].refuse(soft)


def deck_of(code, folder, **parts):
    """(`RunSpec`, text) of a deck of OWN with these parts, written into `folder`."""
    spec = parse_spec(OWN | parts)
    importlib.import_module(f"calibration.engines.{code}").deck(spec, folder)
    text = (folder / f"in.{code}").read_text()
    assert "{" not in text.replace("${", "")
    return spec, text


@pytest.mark.parametrize("code", ["liggghts", "lammps"])
@pytest.mark.parametrize("experiment", ["heap", "drop"])
def test_a_deck_holds_the_spec(tmp_path, code, experiment):
    spec, text = deck_of(code, tmp_path, experiment=experiment)
    steps = Drop(spec).looks[0] if experiment == "drop" else Pour(spec).looks[0]
    assert f"run {steps}" in text


def test_yade_gets_a_script_that_python_can_read(tmp_path):
    sizes = {"by": "number", "diameters_mm": [1.5, 2.0], "fractions": [0.25, 0.75]}
    spec = parse_spec(OWN | {"experiment": "heap", "particles": {"count": 200, "sizes": sizes}})
    yade = importlib.import_module("calibration.engines.yade")
    yade.deck(spec, tmp_path)
    text = (tmp_path / "in.py").read_text()
    for name in ("in.py", "material.py"):
        compile((tmp_path / name).read_text(), name, "exec")
    assert "radii, shares, pitch = [0.00075, 0.001], [0.25, 0.75], 0.0022" in text
    assert f"O.run({Pour(spec).looks[0]}, True)" in text
    entry = {"name": "yade", "identity": {}, "settings": {}}
    with refused(engines.EngineError, "yade", "experiment", "drop", "heap"):
        engines.check(parse_spec(OWN | {"experiment": "drop", "engine": entry}))


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("liggghts", ["mesh cylinder linear 0 0 0.05", "unfix move_cylinder", "meshes plate cyl"]),
        (
            "lammps",
            ["variable cylinder_up equal 0.05*dt", "0.05 -0.01 0 side out", "v_cylinder_up"],
        ),
    ],
)
def test_a_deck_lifts_the_cylinder_off_the_grains_that_ours_starts_from(tmp_path, code, lines):
    sizes = {"by": "number", "diameters_mm": [1.5, 2.0], "fractions": [0.25, 0.75]}
    _, text = deck_of(
        code, tmp_path, experiment="lifted_cylinder", particles={"count": 200, "sizes": sizes}
    )
    assert all(line in text for line in lines)
    atoms, speeds = (tmp_path / "grains.data").read_text().split("Atoms")[1].split("Velocities")
    atoms, speeds = (
        np.array([r.split() for r in t.split("\n") if r], float) for t in (atoms, speeds)
    )
    diameter, place = atoms[:, 2], atoms[:, 4:]
    assert (diameter == 1.5e-3).sum() == 50
    assert (np.hypot(*place[:, :2].T) + 0.5 * diameter).max() < 0.5e-3 * 24.0
    apart = np.linalg.norm(place[:, None] - place, axis=-1) + np.eye(200)
    assert (apart > 0.5 * (diameter[:, None] + diameter)).all()
    fastest = shake(0.5 * diameter.max())
    assert 0.5 * fastest < abs(speeds[:, 1:4]).max() <= fastest


@pytest.mark.parametrize("code", ["liggghts", "lammps"])
def test_a_silo_that_empties_leaves_no_grain_to_dump(tmp_path, code):
    """LIGGGHTS stops at a run without grains."""
    geometry = {"silo_diameter_mm": 40, "orifice_diameter_mm": 16, "hopper_half_angle_deg": 30}
    parts = {"particles": {"count": 5000, "diameter_mm": 2.0}, "geometry": geometry}
    spec, text = deck_of(code, tmp_path, experiment="discharge", **parts)
    filled, opened = text.split({"liggghts": "unfix rig", "lammps": "unfix gate0"}[code])
    assert "jump SELF settled" in filled
    assert "mass(all)" in opened
    flowed = text.split("label flowed")[1]
    leaves, dumps, ends = (
        flowed.index(w) for w in ("jump SELF emptied", "dump end", "label emptied")
    )
    assert leaves < dumps < ends
    place = np.random.default_rng(1).uniform((-0.01, -0.01, 0.03), (0.01, 0.01, 0.09), (500, 3))
    rows = [f"{k} 0.001 {x} {y} {z} 0 0 0 0 0 0" for k, (x, y, z) in enumerate(place, 1)]
    head = "ITEM: TIMESTEP\n1\nITEM: ATOMS id radius x y z vx vy vz omegax omegay omegaz\n"
    (tmp_path / "settled.dump").write_text(head + "\n".join(rows) + "\n")
    mass = 4 / 3 * math.pi * 1e-9 * 1200
    output = "".join(f"left {n} {n * mass}\n" for n in range(450, -1, -50))
    metrics, state = silo_of_other_codes.read(spec, tmp_path, output)
    assert metrics["discharged_share"] == pytest.approx(1.0)
    assert metrics["arched"] == 0
    # fifty grains in each look
    assert metrics["mass_flow_g_s"] == pytest.approx(5e4 * mass / look(spec), rel=0.1)
    assert len(state["radius"]) == 0


RING = {
    "experiment": "shear",
    "particles": {"count": 300, "diameter_mm": 2.0},
    "geometry": {
        "inner_diameter_mm": 14,
        "outer_diameter_mm": 26,
        "normal_stress_kPa": 2.0,
        "preshear_normal_stress_kPa": 3.0,
    },
}


def test_a_deck_presses_the_lid_and_turns_the_trough(tmp_path):
    _, text = deck_of("liggghts", tmp_path, **RING)
    area = math.pi * (0.013**2 - 0.007**2)
    mass = 300 * 1200 * math.pi / 6 * 0.002**3
    first = re.search(r"target_val -(\S+) vel_max (\S+) &\n\s+kp \S+ ki (\S+)", text)
    weight, speed, gain = (float(x) for x in first.groups())
    assert weight == pytest.approx(mass * GRAVITY)
    assert speed * gain / weight == pytest.approx(1.0 / mass)  # what a newton adds in a second
    loads = re.findall(r"equal ([\d.]+)\+\((-?[\d.]+)\)\*v_(\w+)_part/20", text)
    assert [name for *_, name in loads] == ["pressed", "relieved"]
    ends = [float(start) + float(more) for start, more, _ in loads]
    assert ends == [pytest.approx(3000 * area), pytest.approx(2000 * area)]
    period = float(re.search(r"axis 0 0 1 period (\S+)", text)[1])
    assert 2.0 * math.pi * 0.01 / period == pytest.approx(0.03)
    stretches = re.findall(r"ave/time 1 (\d+) \1 f_lid\[3\] f_lid\[6\].*\nrun (\d+)", text)
    assert [int(run) // int(each) for each, run in stretches] == [50, 50]
    _, floor = read_stl(tmp_path / "trough.stl")
    vertices, _ = read_stl(tmp_path / "lid.stl")
    assert len(floor) > 64
    grains = np.array(
        [r.split() for r in (tmp_path / "grains.data").read_text().split("\n\n")[4].split("\n")],
        float,
    )
    assert (vertices[:, 2] > grains[:, 6].max()).all()  # its vanes hang above the grains


def test_a_mesh_s_first_line_is_its_header(tmp_path):
    """LIGGGHTS reads it as text, and its bytes may hold any number of quotes."""
    quoted = np.frombuffer(b'\x00\x00"?', "<f4")[0]
    corners = [np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, quoted, 0.0]])]
    write_mesh(tmp_path / "mesh.stl", corners)
    written = (tmp_path / "mesh.stl").read_bytes()
    first = written.split(b"\n")[0]
    assert written.count(b'"') % 2
    assert b'"' not in first
    assert len(first) < 80
    vertices, triangles = read_stl(tmp_path / "mesh.stl")
    assert np.array_equal(vertices[triangles], np.array(corners, "<f4"))


def test_lammps_presses_a_lid_of_regions_and_turns_the_vanes(tmp_path):
    _, text = deck_of("lammps", tmp_path, **RING)
    area = math.pi * (0.013**2 - 0.007**2)
    mass = 300 * 1200 * math.pi / 6 * 0.002**3
    weight = float(re.search(r"lid_wanted equal ([\d.]+)", text)[1])
    assert weight == pytest.approx(mass * GRAVITY)
    inertia, drag = re.search(r"dt/([\d.e-]+)-([\d.]+)\*v_lid_up", text).groups()
    assert (float(inertia), float(drag)) == (
        pytest.approx(mass),
        pytest.approx(math.sqrt(GRAVITY / 0.001), rel=1e-3),
    )
    loads = re.findall(r"equal ([\d.]+)\+\((-?[\d.]+)\)\*v_(\w+)_part/20", text)
    ends = [float(start) + float(more) for start, more, _ in loads]
    assert ends == [pytest.approx(3000 * area), pytest.approx(2000 * area)]
    # a vane is a block without thickness, 24 on each body, 15 degrees from one to the next
    blocks = re.findall(r"^region (\w+?)\d+ block (\S+) (\S+) 0 0 ", text, re.MULTILINE)
    assert [owner for owner, *_ in blocks] == ["trough"] * 24 + ["lid"] * 24
    assert {(float(a), float(b)) for _, a, b in blocks} == {(0.007003, 0.012997)}
    angles = re.findall(r"^variable trough\d+_turn equal v_trough_turn\+(-?[\d.]+)$", text, re.M)
    turned = np.array(angles[3:], float) % (2.0 * math.pi)  # behind floor and two walls
    assert turned == pytest.approx(np.arange(24) * math.pi / 12, abs=1e-6)
    assert len(re.findall(r"region lid\d+ contacts$", text, re.MULTILINE)) == 25


@pytest.mark.parametrize("by", ["mass", "number"])
def test_a_sieve_curve_is_poured_in_sizes_between_its_sieves(by):
    """Against grains drawn by our own engine: mass, mean size and spread of the whole curve."""
    sizes = {
        "by": by,
        "diameters_mm": [1.0, 2.0],
        "upper_diameters_mm": [2.0, 5.0],
        "fractions": [0.3, 0.7],
    }
    spec = parse_spec(OWN | {"experiment": "heap", "particles": {"sizes": sizes}})
    pour = Pour(spec)
    radii, shares = np.array(pour.radii), np.array(pour.shares)
    drawn = draw_radii(spec, 50_000, np.random.default_rng(1))
    assert len(radii) == 10
    assert 0.5e-3 < radii.min() < radii.max() < 2.5e-3
    assert shares.sum() == pytest.approx(1.0)
    assert shares @ radii**3 == pytest.approx((drawn**3).mean(), rel=0.02)
    assert shares @ radii == pytest.approx(drawn.mean(), rel=0.02)
    assert shares @ (radii - shares @ radii) ** 2 == pytest.approx(drawn.var(), rel=0.1)


def test_a_changed_deck_is_another_run(tmp_path):
    """What writes a deck is part of the run's name, and our words about it are not."""
    folder = Path(shutil.copytree(Path(engines.__file__).parent, tmp_path / "engines"))
    digest = digests.adapter_digest.__wrapped__  # a process has one state of the code
    code = "rigs/discharge.py", "# a comment\n", "\nMORE = 1\n"
    for name, comment, more in (code, ("lammps.j2", "{# a comment #}", "{% set more = 1 %}")):
        file, before = folder / name, digest(folder)
        file.write_text(comment + file.read_text())
        assert digest(folder) == before
        file.write_text(file.read_text() + more)
        assert digest(folder) != before


def test_an_experiment_that_a_code_has_no_rig_for_is_refused_by_name():
    entry = {"name": "lammps", "identity": {}, "settings": {}}
    grains = {"count": 1000, "diameter_mm": 2.0}
    with refused(engines.EngineError, "lammps", "drum", "heap", "discharge", "shear"):
        engines.check(
            parse_spec(OWN | {"experiment": "drum", "particles": grains, "engine": entry})
        )


def test_a_silo_made_of_a_mesh_is_refused_by_the_code_that_has_none(tmp_path):
    stl = tmp_path / "bottom.stl"
    stl.write_text("solid none")
    geometry = {"geometry": {"bottom_stl": str(stl)}, "particles": {"diameter_mm": 2.0}}
    spec = parse_spec(OWN | {"experiment": "discharge"} | geometry)
    engines.engines()["liggghts"].refuse(spec)
    with refused(engines.EngineError, "LAMMPS", "geometry.bottom_stl"):
        engines.engines()["lammps"].refuse(spec)


def test_grains_that_roll_freely_have_no_rolling_friction_in_another_code(tmp_path):
    for code in ("liggghts", "lammps"):
        deck_of(code, tmp_path)  # rolling: none, with a coefficient that stays unused
    block = (tmp_path / "material.in").read_text()
    assert "coefficientRollingFriction peratomtypepair 2 0 0 0 0" in block
    assert (tmp_path / "material.lammps").read_text().count("rolling sds 0 0 0") == 2
