"""Users' first commands begin their studies, and each can be run: its planning without the
pilot."""

import math
import re
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from PIL import Image, ImageDraw

from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.interface.commands import main
from calibration.runs.feasibility import check_ahead
from calibration.runs.plans import read_plan
from calibration.runs.runner import SPREAD, STANDS, causes
from calibration.study.config import parse_config
from calibration.study.config.parse import parse_resolved
from calibration.study.new.methods import methods
from dem.errors import MeasureError
from dem.experiments import experiments
from dem.units import unit_of
from diagnosis.settings import study_settings
from diagnosis.setup import Setup
from facts import tells
from workflow_rules import rules_of

COMMANDS = {
    "wheat":
    "wheat --density 1.32g/cm3 --axes 6.2x3.3x2.9mm --lifted-cylinder 26.1 27.4 28.0 26.8 "
    "27.9 --bulk-density 765kg/m3 sd=6kg/m3 --drop 78mm sd=4mm height=300mm wall=steel "
    "--tilted-plane 21 sd=1 wall=steel",
    "lime":
    "lime --from lime.csv",
    "pellet":
    'pellet --measured "heap 1.png" "heap 2.png" "heap 3.png" --density 0.92g/cm3 --grain '
    "3.8mm --material PP --orifice 40mm --plate 150mm --height 70mm --rim 4mm "
    "--bulk-density 0.56g/cm3 0.57g/cm3",
}  # fmt: skip
"""Study -> what follows `dem new`: three users' measurements."""


TABLE = (
    ("grain", "density=2.7 g/cm3 diameter=50 µm moisture=moist"),
    ("shear-cell", "stress=1.9 load=2"),
    ("shear-cell", "stress=3.4 load=4"),
    ("shear-cell", "stress=4.8 load=6"),
    ("shear-cell", "stress=6.4 load=8"),
    ("bulk-density", "density=0.9 g/cm3 sd=20"),
    ("lifted-cylinder", "angle=51;52;53 cylinder=50 depth=60"),
)
"""(test, its answers) of the limestone powder."""

HEAPS = {"heap 1.png": 24.1, "heap 2.png": 25.3, "heap 3.png": 24.8}


def words_of(name):
    return ["new", *shlex.split(COMMANDS[name])]


def draw_heap(path, angle):
    """A bright cone on a dark table, drawn large and reduced so that its edges are smooth."""
    picture = Image.new("RGB", (1600, 900), (40, 50, 70))
    draw = ImageDraw.Draw(picture)
    draw.rectangle((0, 700, 1600, 900), fill=(100, 80, 60))
    high = 560 * math.tan(math.radians(angle))
    draw.polygon([(240, 700), (800, 700 - high), (1360, 700)], fill=(230, 230, 225))
    noise = np.random.default_rng(1).normal(0, 3, (450, 800, 3))
    small = np.asarray(picture.resize((800, 450), Image.Resampling.BOX), float) + noise
    Image.fromarray(np.clip(small, 0, 255).astype(np.uint8)).save(path)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder with the users' files in it."""
    monkeypatch.chdir(tmp_path)
    for name, angle in HEAPS.items():
        draw_heap(name, angle)
    return tmp_path


def fill(path):
    """Write a table of tests that is filled in."""
    rows = ["test,question,value,unit"]
    for test, cells in TABLE:
        for key, text in re.findall(r"(\w+)=(.*?)(?= \w+=|$)", cells):
            q = methods()[test].question(key)
            rows.append(f"{test},{key},{text},{unit_of(q.unit) or ''}")
    Path(path).write_text("\n".join(rows) + "\n")


def begun(name):
    assert main([*words_of(name), "--no-pilot"]) == 0
    path = Path(name, "config.yaml")
    config = parse_config(yaml.safe_load(path.read_text()), files=[path])
    check_ahead(config)
    return config


@pytest.mark.slow
def test_pellets_from_photographs(here, capsys):
    assert main(["angle", *HEAPS]) == 0
    told = words_of("pellet")
    at = told.index("heap 3.png") + 1
    fits = [name.replace(".png", ".fit.png") for name in HEAPS]
    assert main([*told[:at], *fits, *told[at:], "--no-pilot"]) == 0
    said = capsys.readouterr().out
    assert tells(said, "left out", "heap 2.fit.png")
    assert tells(said, "looks down", "--camera")
    path = Path("pellet/measured.csv")
    values = [float(line.split(",")[2]) for line in path.read_text().splitlines()[1:]]
    assert values[:3] == pytest.approx(list(HEAPS.values()), abs=0.3)


POWDER = ("--density", "2.7g/cm3", "--grain", "50um", "--moisture", "moist", "--no-pilot")


def test_a_test_with_several_readings_leads(here):
    bulk = ["--bulk-density", "0.9g/cm3", "0.91g/cm3"]
    one = ["--lifted-cylinder", "52", "sd=1.5", "cylinder=50mm"]
    assert main(["new", "own", *one, *bulk, *POWDER]) == 0
    config = parse_config(yaml.safe_load(Path("own/config.yaml").read_text()))
    assert config.experiment == "bulk_density"
    # grains stick: one size in all rigs, at which 4,000 fill the cylinder
    sizes = {rig.run["particles"]["diameter_mm"] for rig in config.tests.values() if rig.run}
    assert sizes == {config.own_run["particles"]["diameter_mm"]}
    volume = math.pi / 4 * 50**2 * 75
    assert sizes.pop() == pytest.approx((0.6 * volume / 4000 * 6 / math.pi) ** (1 / 3), rel=1e-3)


def test_a_resolution_that_is_too_coarse_names_what_can_be_done(here):
    """Half the grain's length more than fits five times into the cylinder of 62 mm."""
    begun("wheat")
    files = [Path("wheat/config.yaml")]
    data = yaml.safe_load(files[0].read_text())
    with pytest.raises(ConfigError) as refused:
        parse_resolved(data | {"resolution": "test"}, files)
    said = str(refused.value)
    assert tells(said, "resolution", "test", "2 times", "quick", "full")
    assert refused.value.line is None
    assert parse_resolved(data | {"resolution": "quick"}, files).name == "wheat-quick"


def test_a_diagnosis_of_the_users_own_table_needs_no_edit(here):
    """The ring under the powder's loads is that of the joint study, at the loads of the table."""
    fill("lime.csv")
    config = begun("lime")
    settings = Setup(Study(config), study_settings(config)).settings
    shear = settings.experiments["shear"]
    assert shear.metric == "shear_stress_kPa"
    assert shear.levels == {"normal_stress_kPa": [2.0, 4.0, 6.0, 8.0]}
    rig = config.tests["shear_2_kPa"].run
    assert shear.run["geometry"] == rig["geometry"]
    assert shear.run["particles"] == rig["particles"]


def test_a_diagnosis_drops_the_grain_that_was_dropped(here):
    """The heap's grains may be coarser than the laboratory's; the dropped one is not."""
    again = "--drop 52mm sd=4mm height=200mm --no-pilot".split()
    assert main([*words_of("wheat"), *again]) == 0
    path = Path("wheat/config.yaml")
    config = parse_config(yaml.safe_load(path.read_text()), files=[path])
    settings = Setup(Study(config), study_settings(config)).settings
    dropped = settings.experiments["drop"].run["particles"]["diameter_mm"]
    assert dropped == pytest.approx((6.2 * 3.3 * 2.9) ** (1 / 3), abs=1e-3)
    assert dropped < config.own_run["particles"]["diameter_mm"]


@pytest.mark.slow
def test_grains_of_another_size_stick_by_what_keeps_their_strength(here):
    """The quick profile makes the cylinder's grains larger and not those of vessel and ring. What
    grains hold in tension goes with the energy of their surface over their size: 3 pi g R* of one
    contact (JKR) upon the square of R."""
    fill("lime.csv")
    begun("lime")
    files = [Path("lime/config.yaml")]
    data = yaml.safe_load(files[0].read_text()) | {"joint": {"runs": 8, "repeated": 2}}
    config = parse_resolved(data | {"resolution": "quick"}, files)
    name = "grain_grain_surface_energy"
    rule = rules_of(config.model_dump(mode="json"))["plan_joint_first"]
    rule.call(Study(config))
    design, specs = pd.read_csv(rule.output.design), read_plan(rule.plan)
    sizes = set()
    for rig, rows in design.groupby("rig"):
        own = [specs[run] for run in rows["run_id"]]
        sizes |= {round(spec["particles"]["diameter_mm"], 2) for spec in own}
        strength = [
            spec["law_parameters"]["surface_energy_J_m2"] / spec["particles"]["diameter_mm"]
            for spec in own
        ]
        # the design tells the level of the study's own grains in all rigs
        own_mm = config.own_run["particles"]["diameter_mm"]
        assert strength == pytest.approx(list(rows[name] / own_mm), rel=1e-6), rig
        assert rows[name].nunique() == 8
    assert sizes == {3.23, 5.13}


def test_a_column_that_stands_is_not_told_to_roll_apart():
    spec = {"experiment": "lifted_cylinder", "geometry": {"cylinder_diameter_mm": 50.0}}
    column = np.array([[0.024, 0.0, 0.1], [0.0, -0.024, 0.0]])
    error = MeasureError("no heap: 71 of 72 flanks of the silhouette are too short")
    assert causes(error, spec, column)[0] == STANDS
    for other in (column * [2, 2, 1], None, np.empty((0, 3))):
        assert causes(error, spec, other)[0] == SPREAD
    assert STANDS not in causes(MeasureError("clogged"), spec, column)


@pytest.mark.slow
def test_the_pilot_ends_what_sticks_where_heaps_form(here, monkeypatch, capsys):
    """Heaps form up to 0.4 J/m2 here, with the largest frictions: 3.07, 1.53 and 0.77 have none."""
    made = []

    def run(spec, out):
        energy = spec.law_parameters.surface_energy_J_m2
        if spec.experiment == "lifted_cylinder":
            made.append((energy, spec.contacts.particle_particle.rolling_friction))
            if energy > 0.4:
                raise MeasureError("no heap: 71 of 72 flanks of the silhouette are too short")
        return {"metrics": dict.fromkeys(experiments()[spec.experiment].targets, 90.0)}

    monkeypatch.setattr("dem.precompile.compile_engine", lambda: None)
    monkeypatch.setattr("dem.run.run", run)
    fill("lime.csv")
    assert main(words_of("lime")) == 0
    name = "grain_grain_surface_energy"
    said = capsys.readouterr().out
    assert tells(said, f"{name}: 0.0307 to 3.07 becomes 0.0307 to 0.384", "71 of 72")
    # then the middle of the ranges, and the ends of friction at it
    assert [e for e, _ in made][:4] == pytest.approx([3.07, 1.535, 0.7675, 0.38375])
    assert [e for e, _ in made][4:] == pytest.approx([0.20735] * len(made[4:]))
    assert [r for _, r in made][:5] == pytest.approx([0.4] * 4 + [0.21])
    config = parse_config(yaml.safe_load(Path("lime/config.yaml").read_text()))
    assert config.fixed[name] == pytest.approx(0.2074)
    assert config.own_run["law_parameters"] == {"surface_energy_J_m2": pytest.approx(0.2074)}
    assert "| 0.384 |" in Path("lime/README.md").read_text()
    assert Path("lime/factors.tsv").read_text().count("cut from 0.0307 to 3.07") == 1
