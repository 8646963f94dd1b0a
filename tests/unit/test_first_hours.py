"""Users' first commands begin their studies, and each can be run: its planning without the
pilot."""

import math

import numpy as np
import pandas as pd
import pytest
from new_studies import POWDER, WHEAT, begun, read
from test_photo import DARK, cone

from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.interface.commands import main
from calibration.runs.feasibility import check_ahead
from calibration.runs.plans import read_plan
from calibration.runs.runner import causes
from calibration.study.factors import factor_of, read_factors
from dem.errors import MeasureError
from diagnosis.settings import study_settings
from diagnosis.setup import Setup
from facts import tells
from workflow_rules import rules_of

PELLETS = (
    "--density 0.92g/cm3 --grain 3.8mm --material PP --orifice 40mm --plate 150mm --height 70mm "
    "--rim 4mm --bulk-density 0.56g/cm3 0.57g/cm3 --no-pilot"
).split()


@pytest.mark.slow
def test_pellets_from_photographs(here, capsys):
    heaps = {"heap 1.png": 24.1, "heap 2.png": 25.3, "heap 3.png": 24.8}
    for name, angle in heaps.items():
        cone(name, angle, DARK, noise=0.01)
    assert main(["angle", *heaps]) == 0
    fits = [name.replace(".png", ".fit.png") for name in heaps]
    assert main(["new", "pellet", "--measured", *heaps, *fits, *PELLETS]) == 0
    said = capsys.readouterr().out
    assert tells(said, "left out", "heap 2.fit.png")
    assert tells(said, "looks down", "--camera")
    values = pd.read_csv("pellet/measured.csv")["value"].tolist()
    assert values[:3] == pytest.approx(list(heaps.values()), abs=0.3)


def test_a_test_with_several_readings_leads(here):
    one = "--lifted-cylinder 52 sd=1.5 cylinder=50mm --bulk-density 0.9g/cm3 0.91g/cm3".split()
    config = begun("own", [*one, *"--density 2.7g/cm3 --grain 50um --moisture moist".split()])
    assert config.experiment == "bulk_density"
    # grains stick: one size in all rigs, at which 4,000 fill the cylinder
    sizes = {rig.run["particles"]["diameter_mm"] for rig in config.tests.values() if rig.run}
    assert sizes == {config.own_run["particles"]["diameter_mm"]}
    volume = math.pi / 4 * 50**2 * 75
    assert sizes.pop() == pytest.approx((0.6 * volume / 4000 * 6 / math.pi) ** (1 / 3), rel=1e-3)


def test_a_resolution_that_is_too_coarse_names_what_can_be_done(here):
    """Half the grain's length more than fits five times into the cylinder of 62 mm."""
    check_ahead(begun("wheat", WHEAT))
    with pytest.raises(ConfigError) as refused:
        read("wheat", resolution="test")
    said = str(refused.value)
    assert tells(said, "resolution", "test", "2 times", "finer")
    assert refused.value.line is None
    assert read("wheat", resolution="quick").name == "wheat-quick"


def settings_of(config):
    """The settings with which a study is diagnosed."""
    return Setup(Study(config), study_settings(config)).settings


def test_a_diagnosis_of_the_users_own_table_needs_no_edit(here):
    """The ring under the powder's loads is that of the joint study, at the loads of the table."""
    config = begun("lime", POWDER)
    shear = settings_of(config).experiments["shear"]
    assert shear.metric == "shear_stress_kPa"
    assert shear.levels == {"normal_stress_kPa": [2.0, 4.0, 6.0, 8.0]}
    rig = config.tests["shear_2_kPa"].run
    assert shear.run["geometry"] == rig["geometry"]
    assert shear.run["particles"] == rig["particles"]


def test_a_diagnosis_drops_the_grain_that_was_dropped(here):
    """The heap's grains may be coarser than the laboratory's; the dropped one is not."""
    config = begun("wheat", [*WHEAT, *"--drop 52mm sd=4mm n=5 height=200mm".split()])
    dropped = settings_of(config).experiments["drop"].run["particles"]["diameter_mm"]
    assert dropped == pytest.approx((6.2 * 3.3 * 2.9) ** (1 / 3), abs=1e-3)
    assert dropped < config.own_run["particles"]["diameter_mm"]


@pytest.mark.slow
def test_grains_of_another_size_stick_by_what_keeps_their_strength(here):
    """The quick profile makes the cylinder's grains larger and not those of vessel and ring. What
    grains hold in tension goes with the energy of their surface over their size: 3 pi g R* of one
    contact (JKR) upon the square of R."""
    begun("lime", POWDER)
    config = read("lime", joint={"runs": 8, "repeated": 2}, resolution="quick")
    own_mm = config.own_run["particles"]["diameter_mm"]
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
        assert strength == pytest.approx(list(rows[name] / own_mm), rel=1e-6), rig
        assert rows[name].nunique() == 8
    assert sizes == {3.23, 5.13}


def test_a_column_that_stands_is_not_told_to_roll_apart():
    spec = {"experiment": "lifted_cylinder", "geometry": {"cylinder_diameter_mm": 50.0}}
    column = np.array([[0.024, 0.0, 0.1], [0.0, -0.024, 0.0]])
    error = MeasureError("no heap: 71 of 72 flanks of the silhouette are too short")
    assert causes(error, spec, column)[0].startswith("the grains stand")
    for other in (column * [2, 2, 1], None, np.empty((0, 3))):
        assert causes(error, spec, other)[0].startswith("the grains roll apart")
    assert causes(MeasureError("clogged"), spec, column) == causes(error, spec, column)[1:]


def test_what_sticks_ends_where_heaps_form(here):
    """Pull-off forces of 0.5 to 12.5 weights in a cylinder; up to 50 without a heap."""
    heaped, pressed = begun("lime", POWDER), begun("bed", POWDER[POWDER.index("--moisture") :])
    for config, most in ((heaped, 12.5), (pressed, 50.0)):
        energy = factor_of(read_factors(config.factors), "law_parameters.surface_energy_J_m2")
        assert energy.high / energy.low == pytest.approx(most / 0.5, rel=0.01)
        fixed = pytest.approx(energy.centre, rel=1e-3)
        assert config.own_run["law_parameters"] == {"surface_energy_J_m2": fixed}
