"""Heaps of LIGGGHTS as the tables beside this file have them: `python -m
benchmarks.rates.foreign.heaps_of_liggghts dry`,
`wet` or `sjkr` prints one. Cost: five minutes of one core.

Wet grains have LIGGGHTS' own capillary law (easo/capillary/viscous, by its manual), which is no
law of this project. With `sjkr` grains attract each other by an energy per volume of their overlap,
which is no mechanism of the catalogue.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.rates.foreign_studies import RUN, filled
from calibration import engines
from calibration.engines import liggghts
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay

SIZES = (3.6, 4.2, 5.0, 5.8, 6.4)
SEEDS = range(1, 6)
TENSION = 0.02
"""Surface tension [N/m]."""

DENSITY = 60_000
"""Cohesion energy density [J/m3]."""

TOLD = {
    "dry": "no cohesion",
    "wet": f"capillary law, {TENSION} N/m",
    "sjkr": f"cohesion sjkr, {DENSITY} J/m3",
}
LAWS = {
    "sjkr": {
        "laws": {"cohesion": "sjkr"},
        "law_parameters": {"cohesion_energy_density_J_m3": DENSITY},
    }
}

WET = f"""\
fix wet1 all property/global minSeparationDistanceRatio scalar 1.01
fix wet2 all property/global maxSeparationDistanceRatio scalar 1.1
fix wet3 all property/global surfaceLiquidContentInitial scalar 0.5
fix wet4 all property/global surfaceTension scalar {TENSION}
fix wet5 all property/global fluidViscosity scalar 0.0001
fix wet6 all property/global contactAngle peratomtype 0.0 89.9
fix wet7 all property/global maxLiquidContent scalar 0.5
"""
LAW = "variable law string"


def wetted(command, folder, timeout_s, run=liggghts.run):
    """Run LIGGGHTS with its capillary law in the deck."""
    deck = Path(folder) / "material.in"
    text = deck.read_text().replace(LAW, WET + LAW)
    history = "tangential history"
    deck.write_text(text.replace(history, f"{history} cohesion easo/capillary/viscous"))
    return run(command, folder, timeout_s)


def angles(kind, diameter, root):
    """Angles [deg] of heaps of one kind and size [mm]; nan where none formed."""
    own = LAWS.get(kind, {}) | {"experiment": "heap", "engine": engines.entry_of("liggghts")}
    run = filled(RUN, diameter)
    specs = named(overlay(run, own | {"seed": seed}) for seed in SEEDS)
    found = simulate(specs, root).values()
    return np.array([m["angle_of_repose_deg"] if m else np.nan for m in found])


def main(kind):
    if kind == "wet":
        liggghts.run = wetted
    print(f"# Heaps of {liggghts.version()}, {TOLD[kind]}: made by heaps_of_liggghts.py.")
    print("experiment,quantity,value,unit,sd,n,particle_diameter_mm,outcome")
    with tempfile.TemporaryDirectory() as root:
        for diameter in SIZES:
            found = angles(kind, diameter, root)
            for angle in found[np.isfinite(found)]:
                print(f"heap,angle_of_repose,{angle:.2f},deg,,,{diameter},")
            if lost := int(np.isnan(found).sum()):
                print(f"heap,angle_of_repose,,deg,,{lost},{diameter},clogged")


if __name__ == "__main__":
    main(sys.argv[1])
