"""Tables of heaps, silos, shear cells and densities that another law made go through the diagnosis
unattended: no settings are written, and no more runs are made than the budget.

The tables stand in `foreign/`, each with what made it. Those of a kind share the runs that train
the emulators. Cost of one core: five minutes for the tables of heaps, ten for those of the silo.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from deployed import done
from foreign_studies import DENSITIES, FACTORS, HEAPS, SHEARS, SILOS, study
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from diagnosis.verdict import validate

pytestmark = pytest.mark.slow

RUNS = 80
FEWER = 60
"""Budgets: of the tests of minutes, and of those that are long."""

TABLES = Path(__file__).with_name("foreign")
NAMED = ("identified", "discovered")
TOLD = (*NAMED, "ambiguous")


def diagnosed(folder, name, what, runs=RUNS):
    """verdict.json of a table of `foreign/`, by one call of the workflow; its runs counted."""
    (folder / "factors.tsv").write_text(FACTORS)
    config = study(name, what, TABLES / f"{name}.csv", runs)
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(config))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j1", *NO_PROFILE, "--configfile", f"{name}.yaml"]
    done(*command, "--", "diagnose", cwd=folder)
    found = folder / "results" / name / "diagnosis"
    plans = [found / "plan.json", *found.glob("*/plan.json")]
    planned = {run for plan in plans for run in json.loads(plan.read_text())}
    assert 0 < len(planned) <= runs
    verdict = json.loads((found / "verdict.json").read_text())
    validate(verdict)
    assert (found / "diagnosis.html").is_file()
    assert yaml.safe_load((found / "settings.yaml").read_text())["runs"] == runs
    return verdict


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of the studies, which share their runs."""
    return tmp_path_factory.mktemp("foreign")


def names_in(verdict):
    """All mechanisms that a verdict puts forward."""
    return {*verdict["causes"], *(n for law in verdict["laws"] for n in law["names"])}


def test_dry_heaps_are_adequate(folder):
    verdict = diagnosed(folder, "heaps_dry", HEAPS)
    assert verdict["verdict"] == "adequate", verdict["reason"]
    assert verdict["laws"] == verdict["causes"] == verdict["rows"] == verdict["errors"] == []


def test_wet_heaps_are_told_to_attract_each_other(folder):
    """Both of the catalogue's attractions may stand beside each other; nothing else may."""
    verdict = diagnosed(folder, "heaps_wet", HEAPS)
    assert verdict["verdict"] in NAMED, verdict["reason"]
    [law] = verdict["laws"]
    assert law["slot"] == "attraction"
    assert set(law["names"]) <= {"cohesion", "liquid_bridge"}
    assert verdict["family_p"] < 0.05
    assert verdict["gain"]["held_out_rmse_after"] < verdict["gain"]["held_out_rmse_before"]


def test_an_attraction_that_the_catalogue_lacks_is_given_no_other_name(folder):
    """It may be missed, since rougher grains stand alike."""
    verdict = diagnosed(folder, "heaps_sjkr", HEAPS)
    assert names_in(verdict) <= {"cohesion", "liquid_bridge"}


@dataclass(frozen=True)
class Expected:
    """What a table's diagnosis may say: its verdicts, the slot of the law that leads, and no
    mechanism beside `names`."""

    study: dict
    verdicts: tuple
    slots: tuple = ()
    names: tuple = ()


ATTRACTIONS = ("cohesion", "liquid_bridge")
EXPECTED = {
    "silo_dry": Expected(SILOS, ("adequate",)),
    "silo_cohesive": Expected(SILOS, NAMED, ("attraction",), ("cohesion",)),
    "heaps_wet": Expected(HEAPS, NAMED, ("attraction",), ATTRACTIONS),
    "silo_clogged": Expected(SILOS, TOLD, ("attraction",), ("cohesion",)),
    "shear_dry": Expected(SHEARS, ("adequate",)),
    # over the load alone an attraction is the same formula as a load that was not counted
    "shear_cohesive": Expected(
        SHEARS, TOLD, ("attraction", "load"), (*ATTRACTIONS, "uncounted_load")
    ),
    "shear_falling": Expected(
        SHEARS, TOLD, ("friction", "static_friction"), ("stress_dependent_friction",)
    ),
    "density_dry": Expected(DENSITIES, ("adequate",)),
    "density_cohesive": Expected(DENSITIES, TOLD, ("attraction",), ("cohesion",)),
}
"""Written before the first run of each table was made."""


@pytest.mark.long
@pytest.mark.parametrize("name", EXPECTED)
def test_sixty_runs_say_of_a_table_what_was_expected(folder, name):
    expected = EXPECTED[name]
    verdict = diagnosed(folder, name, expected.study, FEWER)
    assert verdict["verdict"] in expected.verdicts, verdict["reason"]
    assert names_in(verdict) <= set(expected.names)
    assert {law["slot"] for law in verdict["laws"][:1]} <= set(expected.slots)
    assert bool(verdict["laws"]) == bool(expected.slots)
    if "clogged" in (TABLES / f"{name}.csv").read_text():
        assert sum(row["failed"] for row in verdict["outcomes"])
        assert not any("enters no fit" in remark for remark in verdict["remarks"])
