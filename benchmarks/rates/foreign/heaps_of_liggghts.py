"""Heaps of LIGGGHTS as the tables beside this file have them: `python -m
benchmarks.rates.foreign.heaps_of_liggghts dry`, `wet` or `sjkr` prints one. Cost: five minutes of
one core."""

import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.rates.foreign_studies import RUN, filled, read
from calibration import engines
from calibration.engines import liggghts
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay

SEEDS = range(1, 6)
NATURE = read("nature.yaml")
LAW, HISTORY = "variable law string", "tangential history"


def wetted(nature, command, folder, timeout_s, run=liggghts.run):
    """Run LIGGGHTS with a further law in the deck."""
    deck = Path(folder) / "material.in"
    text = deck.read_text().replace(LAW, nature["deck"] + LAW)
    deck.write_text(text.replace(HISTORY, f"{HISTORY} {nature['law']}"))
    return run(command, folder, timeout_s)


def angles(nature, diameter, root):
    """Angles [deg] of heaps of one kind and size [mm]; nan where none formed."""
    own = nature.get("run", {}) | {"experiment": "heap", "engine": engines.entry_of("liggghts")}
    run = filled(RUN, diameter)
    specs = named(overlay(run, own | {"seed": seed}) for seed in SEEDS)
    found = simulate(specs, root).values()
    return np.array([m["angle_of_repose_deg"] if m else np.nan for m in found])


def main(kind):
    nature = NATURE["by_liggghts"][kind]
    if "deck" in nature:
        liggghts.run = partial(wetted, nature)
    print(f"# Heaps of {liggghts.version()}, {nature['told']}: made by heaps_of_liggghts.py.")
    print("experiment,quantity,value,unit,sd,n,particle_diameter_mm,outcome")
    with tempfile.TemporaryDirectory() as root:
        for diameter in NATURE["levels"]["coarse"]["particle_diameter_mm"]:
            found = angles(nature, diameter, root)
            for angle in found[np.isfinite(found)]:
                print(f"heap,angle_of_repose,{angle:.2f},deg,,,{diameter},")
            if lost := int(np.isnan(found).sum()):
                print(f"heap,angle_of_repose,,deg,,{lost},{diameter},clogged")


if __name__ == "__main__":
    main(sys.argv[1])
