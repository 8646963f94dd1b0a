"""A joint study of heap and discharge in LIGGGHTS, with no run of this project's engine.

What was measured are heaps and discharges of LIGGGHTS too, with known friction and seeds of their
own. The heap tells rolling friction and friction together, a silo's flow mostly friction.

A silo is filled for as long as `max_time_s` says: grains that turn on their rolling springs there
never rest. So its grains are softer than the heap's, for longer steps. Cost: 18 heaps of 400 grains
and 16 silos of 1,180, eight and a half minutes of one core."""

import json
from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest
import yaml
from deployed import done
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from calibration import engines
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay, point_spec
from other_codes import entry_or_skip
from small_heap import RUN

pytestmark = [pytest.mark.slow, pytest.mark.long, pytest.mark.peer]

PAIR = "contacts.particle_particle"
TRUTH = {"rolling": 0.15, "friction": 0.4}
KEYS = {"rolling": f"{PAIR}.rolling_friction", "friction": f"{PAIR}.static_friction"}
FACTORS = f"""code\tname\tkey\tlow\thigh\tdescription
A\trolling\t{KEYS["rolling"]}\t0.02\t0.4\tof grain and grain
B\tfriction\t{KEYS["friction"]}\t0.2\t0.8\tof grain and grain
"""
SILO = {
    "contacts": RUN["contacts"],
    "materials": {"particle": {"shear_modulus_Pa": 2e5}},
    "particles": {"count": 1180, "diameter_mm": 5.8},
    "geometry": {
        "silo_diameter_mm": 72.5,
        "orifice_diameter_mm": 29.0,
        "hopper_half_angle_deg": 30.0,
    },
    "numerics": {"max_time_s": 4.0},
}
TESTS = {
    "heap": ("height", "height_mm", "mm", 6),
    "discharge": ("mass_flow", "mass_flow_g_s", "g/s", 4),
}
"""{experiment: (quantity, metric, unit, readings)}."""
SHARED = {key: RUN[key] for key in ("materials", "laws")}
HEAP = {key: part for key, part in RUN.items() if key not in SHARED}
STUDY = {
    "engine": "liggghts",
    "seed": 300,
    "factors": "factors.tsv",
    "measurements": "measured.csv",
    "calibrate": {"to": {"height_mm": {}}},
    "run": SHARED,
    "tests": {"heap": {"experiment": "heap", "metrics": ["height_mm"], "run": HEAP},
              "silo": {"experiment": "discharge", "metrics": ["mass_flow_g_s"], "run": SILO}},
    "joint": {"runs": 10, "repeated": 2, "second_wave": 0},
    "runs_per_job": 8,
}  # fmt: skip
NARROWER = 0.8
"""Of the area that the heap alone leaves of both frictions, what both tests may leave at most."""


def measured(folder):
    """Text of the table: heaps and discharges of the truth."""
    plain = {key: RUN[key] for key in ("materials", "laws")}
    runs = {"heap": RUN, "discharge": overlay(plain, SILO)}
    lines = ["experiment,quantity,value,unit,orifice_diameter_mm"]
    for experiment, (quantity, metric, unit, readings) in TESTS.items():
        levels = {KEYS[name]: level for name, level in TRUTH.items()}
        own = runs[experiment] | {"engine": engines.entry_of("liggghts")}
        specs = named(point_spec(own, experiment, levels, 9000 + n) for n in range(readings))
        orifice = runs[experiment]["geometry"]["orifice_diameter_mm"] * (experiment == "discharge")
        for metrics in simulate(specs, folder).values():
            lines.append(f"{experiment},{quantity},{metrics[metric]:.4f},{unit},{orifice or ''}")
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where both studies have been made: by both targets, and by the heap alone, which shares all
    runs."""
    entry_or_skip("liggghts")
    folder = tmp_path_factory.mktemp("joint")
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(measured(folder / "truth"))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j1", *NO_PROFILE, "--configfile"]
    for name, tests in (("both", ["heap", "silo"]), ("alone", ["heap"])):
        study = STUDY | {"name": name, "joint": STUDY["joint"] | {"tests": tests}}
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(study))
        done(*command, f"{name}.yaml", "--", "joint", cwd=folder)
    return folder / "results"


def summary(folder, name) -> Mapping:
    return json.loads((folder / name / "joint" / "joint.json").read_text())


def left(folder, name) -> float:
    """Area that a study leaves of both frictions."""
    draws = pd.read_csv(folder / name / "joint" / "draws.csv")[list(TRUTH)]
    return float(np.sqrt(np.linalg.det(np.cov(draws.T))))


def test_all_runs_are_the_other_code_s(folder):
    results = [json.loads(p.read_text()) for p in (folder / "runs").glob("*/result.json")]
    planned = STUDY["joint"]["runs"] + STUDY["joint"]["repeated"]
    assert sorted(r["experiment"] for r in results) == ["discharge"] * planned + ["heap"] * planned
    assert {r["engine"] for r in results} == {"other: liggghts"}
    assert summary(folder, "both")["runs"] == {"heap": planned, "silo": planned}


def test_both_frictions_are_found_again(folder):
    found = summary(folder, "both")
    for name, truth in TRUTH.items():
        low, high = found["parameters"][name]["interval"]
        assert low < truth < high
    assert not found["agreement"]["contradicts"]


def test_the_silo_tells_what_the_heap_leaves_open(folder):
    assert left(folder, "both") < NARROWER * left(folder, "alone")
