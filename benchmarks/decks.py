"""Pour the heaps of `trials.json` again, of its own run spec: `python -m benchmarks.decks` writes
the file. It needs LIGGGHTS, LAMMPS and YADE. Cost: about fifteen minutes of one core. Heaps are
kept in results/trials or the folder that is named, so that a call that was cut off goes on where it
stopped."""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import yaml

from calibration.chain.handed_over import NamedFiles
from calibration.errors import CalibrationError
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.runs.simulated import simulate
from calibration.study.config import overlay
from calibration.telling.export import decks, rolling
from calibration.telling.export.decks import OWN, TRIALS, trials
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import RunSpec, parse_spec


@dataclass(frozen=True)
class Kind:
    """One law, or one kind of grain, that is poured in several codes, as decks.yaml has it."""

    changes: Mapping[str, Any]
    codes: Sequence[str] = (*decks.DECKS, "yade")
    converted: bool = False


KINDS = {
    name: Kind(**kind)
    for name, kind in yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text()).items()
}
SIZES = KINDS["elastic_plastic, sieve curve"].changes["particles"]["sizes"]
METRIC, MARGIN, UNIT = "radial_angle_deg", 2.0, "deg"
STATED = {
    "metric": METRIC, "mean": 0.0, "sd": 0.0, "runs": 1, "margin": MARGIN, "unit": UNIT,
    "heaps": [],
}  # fmt: skip
"""What the decks of the trial state of the calibrated model: nothing of it is used."""


def poured(name: str, folder: str | Path) -> dict[str, Any]:
    """Changes, conversion and {code: profiles of its heaps} of one of KINDS, this engine's heaps
    among them; folder: where the decks and their heaps are kept."""
    kind, place = KINDS[name], Path(folder) / name.replace(", ", "_").replace(" ", "_")
    mapping = overlay(trials()["spec"], kind.changes)
    spec, found = parse_spec(mapping), converted(mapping, place) if kind.converted else None
    wanted, heaps = range(spec.seed, spec.seed + decks.SEEDS), {}
    for code in kind.codes:
        deck = deck_in(place, code, spec, found)
        heaps[code] = decks.heaps_there(deck, wanted, 3600.0)
        if OWN not in heaps:
            heaps[OWN] = decks.heaps_here(deck, wanted)
    return {"changes": kind.changes, "rolling": found, "heaps": heaps}


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
    if scan.empty:
        raise CalibrationError("the law that is to be converted needs no search")
    check = made("confirmation", lambda files: rolling.plan_confirmation(mapping, scan, files))
    own = rolling.angles_of(scan, rolling.CALIBRATED)
    evidence = rolling.Evidence(scan, check, own, MARGIN)
    moved = made("correction", lambda files: rolling.plan_correction(mapping, evidence, files))
    return rolling.conclude(parse_spec(mapping), evidence, moved, UNIT)


def deck_in(folder: Path, code: str, spec: RunSpec, found: Mapping[str, Any] | None) -> decks.Deck:
    """The deck of a run spec for a code, whose heaps are kept in a folder. found: content of
    rolling.json, or None where the numbers stay as they are."""
    place = folder / code
    place.mkdir(parents=True, exist_ok=True)
    return decks.Deck(place, code, spec, STATED | {"rolling": found})


def main(folder: str | Path = "results/trials") -> int:
    """Write trials.json."""
    codes = dict.fromkeys(code for kind in KINDS.values() for code in kind.codes)
    by = {code: decks.engine_of(code).version() for code in codes} | {OWN: engine_fingerprint()}
    made = {name: poured(name, folder) for name in KINDS}
    write_json(TRIALS, {"spec": trials()["spec"], "poured_by": by, "trials": made})
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
