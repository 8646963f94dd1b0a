"""Pour the heaps of `trials.json` again, of its own run spec: `python -m benchmarks.decks` writes
the file. It needs LIGGGHTS, LAMMPS and YADE. Cost: about fifteen minutes of one core."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import yaml

from calibration.chain.study import NamedFiles
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.runs.simulated import simulate
from calibration.study.config import overlay
from calibration.telling.export import decks, rolling
from calibration.telling.export.decks import OWN, TRIALS, trials
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import parse_spec

KINDS: dict[str, dict[str, Any]] = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text())
SIZES = KINDS["elastic_plastic, sieve curve"]["changes"]["particles"]["sizes"]
FOLDER = Path("results/trials")
"""Of the decks and their heaps."""
CODES = (*decks.DECKS, "yade")
METRIC, MARGIN, UNIT = "radial_angle_deg", 2.0, "deg"
STATED = {
    "metric": METRIC, "mean": 0.0, "sd": 0.0, "runs": 1, "margin": MARGIN, "unit": UNIT,
    "heaps": [],
}  # fmt: skip
"""What the decks of the trial state of the calibrated model: nothing of it is used."""


def poured(name: str) -> dict[str, Any]:
    """Changes, conversion and {code: profiles of its heaps} of one of KINDS, this engine's heaps
    among them."""
    kind, place = KINDS[name], FOLDER / name.replace(", ", "_").replace(" ", "_")
    mapping = overlay(trials()["spec"], kind["changes"])
    found = converted(mapping, place) if kind.get("converted") else None
    spec = parse_spec(mapping)
    wanted, heaps = range(spec.seed, spec.seed + decks.SEEDS), {}
    for code in kind.get("codes", CODES):
        folder = place / code
        folder.mkdir(parents=True, exist_ok=True)
        deck = decks.Deck(folder, code, spec, STATED | {"rolling": found})
        heaps[code] = decks.heaps_there(deck, wanted, 3600.0)
        if OWN not in heaps:
            heaps[OWN] = decks.heaps_here(deck, wanted)
    return {"changes": kind["changes"], "rolling": found, "heaps": heaps}


def converted(mapping: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return what the stage `export_converted` finds for a run spec (a mapping) of few grains:
    content of rolling.json. folder: where its runs are kept."""
    runs = folder / "runs"

    def made(name, plan):
        files = cast(NamedFiles, SimpleNamespace(plan=folder / name / "plan.json"))
        plan(files)
        design = read_written(folder / name / "design.csv")
        found = simulate(read_json(files.plan), runs)
        # NaN of one that ends without, such as a clogged funnel
        angles = [(found[name] or {}).get(METRIC, math.nan) for name in design["run_id"]]
        return design.assign(response=angles)

    scan = made("scan", lambda files: rolling.plan_scan(mapping, files))
    check = made("confirmation", lambda files: rolling.plan_confirmation(mapping, scan, files))
    own = rolling.angles_of(scan, rolling.CALIBRATED)
    evidence = rolling.Evidence(scan, check, own, MARGIN)
    moved = made("correction", lambda files: rolling.plan_correction(mapping, evidence, files))
    return rolling.conclude(parse_spec(mapping), evidence, moved, UNIT)


if __name__ == "__main__":
    BY = {code: decks.engine_of(code).version() for code in CODES} | {OWN: engine_fingerprint()}
    MADE = {name: poured(name) for name in KINDS}
    write_json(TRIALS, {"spec": trials()["spec"], "poured_by": BY, "trials": MADE})
