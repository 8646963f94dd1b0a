"""Tables of heaps and of a silo that another law made go through the diagnosis unattended: no
settings are written, and no more runs are made than the budget.

The tables stand in `foreign/`, each with what made it. Those of a kind share the runs that train
the emulators. Cost of one core: five minutes for the tables of heaps, eight for those of the silo.
"""

import json
from pathlib import Path

import pytest
import yaml
from deployed import done
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from diagnosis.verdict import validate
from small_heap import RUN

pytestmark = pytest.mark.slow

BUDGET = 80
TABLES = Path(__file__).with_name("foreign")
FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\tof grain and grain
B\tfriction\tcontacts.particle_particle.static_friction\t0.3\t0.8\tof grain and grain
C\twall_friction\tcontacts.particle_wall.static_friction\t0.3\t0.8\tof grain and wall
"""
SILO = {k: RUN[k] for k in ("materials", "contacts", "laws")} | {
    "particles": {"count": 2600, "diameter_mm": 2.0},
    "geometry": {"silo_diameter_mm": 32.5, "orifice_diameter_mm": 12.0},
    "numerics": {"max_time_s": 6.0},
}
# grains that nothing keeps from spinning about the vertical never come to rest
RESTING = RUN | {"laws": RUN["laws"] | {"torsion": "marshall"}}
HEAPS = {"target": {"metric": "angle_of_repose_deg"}, "run": RESTING}
SILOS = {"experiment": "discharge", "target": {"metric": "mass_flow_g_s"}, "run": SILO}


def diagnosed(folder, name, what):
    """verdict.json of a table of `foreign/`, by one call of the workflow; its runs counted."""
    (folder / "factors.tsv").write_text(FACTORS)
    study = what | {
        "name": name,
        "factors": "factors.tsv",
        "measurements": str(TABLES / f"{name}.csv"),
        "fixed": {"rolling": 0.2, "friction": 0.6, "wall_friction": 0.6},
        "diagnosis": {"runs": BUDGET, "batches": 2},
    }
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(study))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j1", *NO_PROFILE, "--configfile", f"{name}.yaml"]
    done(*command, "--", "diagnose", cwd=folder)
    found = folder / "results" / name / "diagnosis"
    plans = [found / "plan.json", *found.glob("*/plan.json")]
    planned = {run for plan in plans for run in json.loads(plan.read_text())}
    assert 0 < len(planned) <= BUDGET
    verdict = json.loads((found / "verdict.json").read_text())
    validate(verdict)
    assert (found / "diagnosis.html").is_file()
    assert yaml.safe_load((found / "settings.yaml").read_text())["runs"] == BUDGET
    return verdict


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of the studies, which share their runs."""
    return tmp_path_factory.mktemp("foreign")


@pytest.mark.parametrize(
    ("name", "what"),
    [("heaps_dry", HEAPS), pytest.param("silo_dry", SILOS, marks=pytest.mark.long)],
)
def test_a_table_without_cohesion_is_adequate(folder, name, what):
    verdict = diagnosed(folder, name, what)
    assert verdict["verdict"] == "adequate", verdict["reason"]
    assert verdict["laws"] == verdict["causes"] == verdict["rows"] == verdict["errors"] == []


def test_wet_heaps_are_told_to_attract_each_other(folder):
    """Both of the catalogue's attractions may stand beside each other; nothing else may."""
    verdict = diagnosed(folder, "heaps_wet", HEAPS)
    assert verdict["verdict"] in ("identified", "discovered"), verdict["reason"]
    [law] = verdict["laws"]
    assert law["slot"] == "attraction"
    assert set(law["names"]) <= {"cohesion", "liquid_bridge"}
    assert verdict["family_p"] < 0.05
    assert verdict["gain"]["held_out_rmse_after"] < verdict["gain"]["held_out_rmse_before"]


@pytest.mark.long
def test_a_cohesive_silo_is_not_adequate_and_nothing_but_cohesion_is_tried(folder):
    """Its name may be withdrawn: flows scatter by a half, and few runs decide."""
    verdict = diagnosed(folder, "silo_cohesive", SILOS)
    assert verdict["verdict"] in ("identified", "discovered", "unexplained")
    named = {n for law in verdict["laws"] for n in law["names"]}
    assert named | set(verdict.get("best_tried", [])) == {"cohesion"}
    assert verdict["family_p"] < 0.05
    assert verdict["gain"]["held_out_rmse_after"] < verdict["gain"]["held_out_rmse_before"]


def test_an_attraction_that_the_catalogue_lacks_is_given_no_other_name(folder):
    """It may be missed, since rougher grains stand alike."""
    verdict = diagnosed(folder, "heaps_sjkr", HEAPS)
    named = {n for law in verdict["laws"] for n in law["names"]}
    assert named <= {"cohesion", "liquid_bridge"}
