"""Heaps of another code through the diagnosis unattended: no settings are written, and no more runs
are made than the budget.

LIGGGHTS pours heaps of 400 grains of five sizes, without cohesion and with it; this engine
simulates them. Cost: 15 heaps of LIGGGHTS and at most 60 of this engine a table."""

import json

import pytest
import yaml
from deployed import done
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from calibration import engines
from calibration.errors import ConfigError
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay
from diagnosis.catalogue import load_catalogue
from diagnosis.verdict import validate
from small_heap import RUN

# `long`, as it has not been seen to its end
pytestmark = [pytest.mark.slow, pytest.mark.long, pytest.mark.peer]

BUDGET = 60
FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\tof grain and grain
B\tfriction\tcontacts.particle_particle.static_friction\t0.3\t0.8\tof grain and grain
C\twall_friction\tcontacts.particle_wall.static_friction\t0.3\t0.8\tof grain and wall
"""
HEADER = "experiment,quantity,value,unit,sd,n,particle_diameter_mm,outcome\n"
SIZES = (4.8, 5.3, 5.8, 6.4, 7.0)
SEEDS = 3
COHESION = {
    "laws": {"cohesion": "sjkr"},
    "law_parameters": {"cohesion_energy_density_J_m3": 80_000},
}


def study(run):
    """A configuration that names no key of the diagnosis but its budget."""
    return {
        "name": "theirs",
        "factors": "factors.tsv",
        "measurements": "measured.csv",
        "target": {"metric": "angle_of_repose_deg"},
        "run": run,
        "fixed": {"rolling": 0.2, "friction": 0.6, "wall_friction": 0.6},
        "diagnosis": {"runs": BUDGET, "batches": 2},
    }


def diagnosed(folder, rows):
    """verdict.json of a table of rows, by one call of the workflow; its runs counted."""
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(HEADER + "".join(rows))
    (folder / "study.yaml").write_text(yaml.safe_dump(study(RUN)))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j2", *NO_PROFILE, "--configfile", "study.yaml"]
    done(*command, "--", "diagnose", cwd=folder)
    found = folder / "results" / "theirs" / "diagnosis"
    plans = [found / "plan.json", *found.glob("*/plan.json")]
    planned = {name for plan in plans for name in json.loads(plan.read_text())}
    assert 0 < len(planned) <= BUDGET
    verdict = json.loads((found / "verdict.json").read_text())
    validate(verdict)
    assert (found / "diagnosis.html").is_file()
    assert yaml.safe_load((found / "settings.yaml").read_text())["runs"] == BUDGET
    return verdict


@pytest.fixture(scope="module")
def heaps(tmp_path_factory):
    """A function: rows of LIGGGHTS' heaps of RUN with changes."""
    try:
        entry = engines.entry_of("liggghts")
    except ConfigError as error:
        pytest.skip(str(error))
    root = tmp_path_factory.mktemp("liggghts")

    def rows(changes):
        out = []
        for d in SIZES:
            grains = {"count": round(400 * (5.8 / d) ** 3), "diameter_mm": d}
            specs = named(
                overlay(RUN, changes)
                | {"experiment": "heap", "seed": seed, "engine": entry, "particles": grains}
                for seed in range(SEEDS)
            )
            found = list(simulate(specs, root).values())
            angles = [m["angle_of_repose_deg"] for m in found if m]
            if len(angles) > 1:  # a reading alone has no spread
                out += [f"heap,angle_of_repose,{angle},deg,,,{d},\n" for angle in angles]
            if len(angles) < SEEDS:
                out.append(f"heap,angle_of_repose,,deg,,{SEEDS - len(angles)},{d},clogged\n")
        return out

    return rows


def test_heaps_of_another_code_without_cohesion_name_nothing(heaps, tmp_path):
    verdict = diagnosed(tmp_path, heaps({}))
    assert verdict["verdict"] not in ("identified", "discovered")
    assert {r["experiment"] for r in verdict["residuals"]} == {"heap"}


def test_heaps_of_another_code_with_cohesion_go_through(heaps, tmp_path):
    """What is named, if anything, can be cohesion: an attraction."""
    verdict = diagnosed(tmp_path, heaps(COHESION))
    known = load_catalogue()
    for cause in verdict["causes"] if verdict["verdict"] == "identified" else ():
        assert {known[n].law for n in cause.split(" + ")} & {
            known["cohesion"].law,
            known["liquid_bridge"].law,
        }
