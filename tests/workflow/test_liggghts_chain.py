"""A study in LIGGGHTS: its screening is planned, run and judged by the workflow with no run of this
project's engine. Cost: eight heaps of 400 grains, about 90 s of one core."""

import json

import pytest
import yaml
from deployed import done
from test_module import NO_PROFILE, ROOT, SNAKEMAKE

from calibration import engines
from calibration.errors import ConfigError

pytestmark = [pytest.mark.slow, pytest.mark.long, pytest.mark.peer]

FACTORS = """code\tname\tkey\tlow\thigh\tdescription
A\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\tof grain and grain
B\tfriction\tcontacts.particle_particle.static_friction\t0.3\t0.8\tof grain and grain
C\trestitution\tcontacts.particle_particle.restitution\t0.3\t0.6\tof grain and grain
"""
MEASURED = "experiment,quantity,value,unit\n" + "heap,angle_of_repose,{},deg\n" * 3
MATERIALS = {
    "particle": {"density_kg_m3": 1200, "shear_modulus_Pa": 3e6, "poisson_ratio": 0.25},
    "wall": {"density_kg_m3": 7800, "shear_modulus_Pa": 8e10, "poisson_ratio": 0.3},
}
STUDY = {
    "name": "theirs",
    "engine": "liggghts",
    "factors": "factors.tsv",
    "measurements": "measured.csv",
    "target": {"metric": "angle_of_repose_deg"},
    "run": {
        "materials": MATERIALS,
        "contacts": {
            "particle_wall": {
                "restitution": 0.5, "static_friction": 0.6, "rolling_friction": 0.2
            }
        },
        "laws": {"rolling": "elastic_plastic"},
        "particles": {"count": 400, "diameter_mm": 5.8},
        "geometry": {
            "generation_rate_per_s": 1250,
            "orifice_diameter_mm": 32,
            "discharge_height_mm": 40,
        },
        "numerics": {"max_time_s": 3.0},
    },
    "screening": {"kind": "plackett_burman", "runs": 4, "replicates": 2},
}  # fmt: skip


def test_a_screening_in_liggghts_finds_that_rolling_matters(tmp_path):
    """All runs are LIGGGHTS' own, and more rolling friction makes a steeper heap there too."""
    try:
        version = engines.entry_of("liggghts")["identity"]["version"]
    except ConfigError as error:
        pytest.skip(str(error))
    (tmp_path / "factors.tsv").write_text(FACTORS)
    (tmp_path / "measured.csv").write_text(MEASURED.format(20, 21, 22))
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(STUDY))
    snakefile = ("--snakefile", ROOT / "workflow" / "Snakefile")
    command = [*SNAKEMAKE, *snakefile, "-j1", *NO_PROFILE, "--configfile", "study.yaml"]
    done(*command, "--", "screening", cwd=tmp_path)
    results = [json.loads(p.read_text()) for p in tmp_path.glob("results/runs/heap-*/result.json")]
    assert len(results) == 8
    for result in results:
        assert result["engine"] == "other: liggghts"
        assert result["spec"]["engine"]["identity"]["version"] == version
    assert not list(tmp_path.glob("results/runs/*.compiled"))  # nothing of ours was compiled
    folder = tmp_path / "results/theirs/screening"
    rows = (folder / "effects.csv").read_text().splitlines()
    columns = rows[0].split(",")
    effects = {r.split(",")[columns.index("code")]: float(r.split(",")[columns.index("effect")])
               for r in rows[1:]}  # fmt: skip
    assert effects["A"] > 0.0
