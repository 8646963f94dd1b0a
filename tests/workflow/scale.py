"""What the workflow adds to a run: `python tests/workflow/scale.py FOLDER RUNS [--plan]`.

A screening of RUNS stub runs, which cost nothing, is made by `snakemake -j2`. Printed are
the seconds of a core, of all processes together, less what the runs themselves took, a run; and the
memory of snakemake, the files, and what a second call costs that finds all done. With --plan
nothing is run beyond the plan.
"""

import itertools
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import psutil
from deployed import checkout

from calibration.study.factors import read_factors
from calibration.study.new.study import write_factors

EXPERIMENT = '''"""A run that costs nothing: its result is written, and nothing moves."""

import random

from dem.experiments.declare import Experiment, Metric, Quantity
from dem.experiments.setup import WALL, build_simulation
from dem.schema import Part, field
from dem.walls.builder import WallSet


class Nothing(Part):
    """No rig."""

    height_mm: float = field(1.0, "of no effect", gt=0)


def run(spec, context):
    """The metric is a plane of two coefficients, and a scatter of the seed."""
    walls = WallSet().body("plate", material=WALL).plane((0, 0, 0), (0, 0, 1))
    context.finish(build_simulation(spec, walls))
    pair = spec.contacts.particle_particle
    scatter = random.Random(f"{spec.seed} {spec.contacts}").uniform(-0.5, 0.5)
    return {"value": 20.0 + 10.0 * pair.static_friction + 30.0 * pair.rolling_friction + scatter}


EXPERIMENT = Experiment(
    name="nothing",
    title="Nothing",
    geometry=Nothing,
    run=run,
    metrics=(Metric("value", "a plane and a scatter", 0.0),),
    quantity=Quantity("value", "", 1e-3, 1e3, "value", relative=False),
)
'''
CODES = "ABCDEFG"
"""Of the factors of the salt. The design holds every combination of two levels, repeated with other
seeds."""

SHARE = 1250
"""Stub runs of a process."""

STUB = """name: scale
runs_per_job: {share}
seed: 1
factors: factors.tsv
measurements: measured.csv
tests: {{nothing: {{experiment: nothing}}}}
fixed: {fixed}
run:
  materials: {{ particle: {{ density_kg_m3: 2500, shear_modulus_Pa: 1.0e+7, poisson_ratio: 0.2 }} }}
  particles: {{count: 1, diameter_mm: 2.0}}
screening: {{design: design.csv}}
"""
MEASURED = "experiment,quantity,value,unit,sd,n\nnothing,value,32,1,0.5,5\n"


def study(folder, runs):
    """A folder with a study of so many runs."""
    checkout(folder)
    (folder / "mine").mkdir(exist_ok=True)
    (folder / "mine/nothing.py").write_text(EXPERIMENT)
    rows = list(itertools.product((-1, 1), repeat=len(CODES)))
    rows *= -(-runs // len(rows))
    lines = [",".join(CODES), *(",".join(map(str, row)) for row in rows)]
    (folder / "design.csv").write_text("\n".join(lines) + "\n")
    (folder / "measured.csv").write_text(MEASURED)
    factors = read_factors("config/factors.tsv")
    write_factors(folder / "factors.tsv", factors)
    fixed = json.dumps({f.name: f.centre for f in factors})
    (folder / "study.yaml").write_text(STUB.format(share=SHARE, fixed=fixed))


def call(folder, *targets):
    """One snakemake: (seconds of a core of it and all its children, largest memory of the main
    process [bytes], seconds by the clock)."""
    before, began, largest = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic(), 0
    command = [sys.executable, "-m", "snakemake", "-j2", *targets, "--configfile", "study.yaml"]
    with open(folder / "campaign.log", "a") as log:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdout=log,
            stderr=log,
            env=os.environ | {"DEM_EXPERIMENTS": str(folder / "mine")},
        )
        while process.poll() is None:
            try:
                largest = max(largest, psutil.Process(process.pid).memory_info().rss)
            except psutil.Error:
                pass
            time.sleep(0.2)
    if process.returncode:
        raise SystemExit(f"snakemake failed: see {folder / 'campaign.log'}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, largest, time.monotonic() - began


def told(what, spent, largest, clock, runs):
    print(
        f"{what}: {spent:.1f} s of a core ({1e3 * spent / runs:.1f} ms a run), {clock:.0f} s by "
        f"the clock, {largest / 2**20:.0f} MB",
        flush=True,
    )


def main(folder, runs, plan):
    """Measure, and print."""
    study(folder, runs)
    if plan:
        target = "results/scale/screening/plan.json"
        told("plan", *call(folder, target), runs)
        told("dry run of all", *call(folder, "screening", "--dry-run", "--quiet", "all"), runs)
        return
    spent, largest, clock = call(folder, "screening")
    results = [json.loads(p.read_text()) for p in folder.glob("results/runs/*/result.json")]
    inside = sum(r["numerics"]["wall_time_s"] for r in results)
    print(f"{len(results)} results; the runs themselves: {inside:.1f} s")
    told("screening", spent, largest, clock, len(results))
    told("screening without the runs", spent - inside, largest, clock, len(results))
    told("again, all done", *call(folder, "screening"), len(results))
    print(f"{sum(len(files) for _, _, files in os.walk(folder / 'results'))} files")


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute(), int(sys.argv[2]), "--plan" in sys.argv)
