"""Tables of heaps, shear cells, bulk densities and a silo by this project's own engine, and of
heaps by LIGGGHTS, as they lie beside this file: `python -m
benchmarks.rates.foreign.tables_of_the_engine NAME` prints one. Cost: some minutes of one core."""

import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.rates.engine_tables import EXPECTED
from benchmarks.rates.foreign_studies import read
from calibration import engines
from calibration.engines import liggghts
from calibration.intake.quantities import LEVERS, QUANTITIES, measurable
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay

NATURE = read("nature.yaml")
LAW, HISTORY = "variable law string", "tangential history"


def filled(run, diameter_mm):
    """A run with grains of another size, of the same volume together: what a vessel or a funnel is
    filled with, of any grains."""
    grains = run["particles"]
    count = round(grains["count"] * (grains["diameter_mm"] / diameter_mm) ** 3)
    return overlay(run, {"particles": {"count": count, "diameter_mm": diameter_mm}})


def of_two_sizes(diameter, smaller):
    """Grains of two sizes, half by number, of the volume together that the stated one has."""
    sizes = [smaller * diameter, (2.0 - smaller**3) ** (1.0 / 3.0) * diameter]
    return {"particles": {"sizes": {"diameters_mm": sizes, "fractions": [0.5, 0.5]}}}


def wetted(nature, command, folder, timeout_s, run=liggghts.run):
    """Run LIGGGHTS with a further law in the deck."""
    deck = Path(folder) / "material.in"
    text = deck.read_text().replace(LAW, nature["deck"] + LAW)
    deck.write_text(text.replace(HISTORY, f"{HISTORY} {nature['law']}"))
    return run(command, folder, timeout_s)


def main(name):
    """Print a table, a line a run."""
    own = {"seed": NATURE["seed"], "told": "no further law"} | NATURE["tables"][name]
    ((_, test),) = EXPECTED[name].study["tests"].items()
    ((lever, levels),) = own["levels"].items()
    kind = test["experiment"]
    quantity = QUANTITIES[kind]
    key = measurable(kind)[quantity.name].key
    part, place = LEVERS[lever].place
    base = overlay(test["run"], {"numerics": {"rayleigh_fraction": NATURE["steps"][kind]}})
    base = overlay(base, own.get("run", {}) | {"experiment": kind})
    by = "this project's engine"
    if "engine" in own:
        by, base["engine"] = liggghts.version(), engines.entry_of(own["engine"])
    if "deck" in own:
        liggghts.run = partial(wetted, own)
    seeds = range(own["seed"], own["seed"] + 5)
    step = 100 * base["numerics"]["rayleigh_fraction"]
    print(f"# By {by}, {own['told']}, {step:g} % of the Rayleigh step, ", end="")
    print(f"seeds {seeds[0]} to {seeds[-1]}:")
    print(f"# tables_of_the_engine.py {name}.")
    print(f"experiment,quantity,value,unit,sd,n,{lever},outcome")
    with tempfile.TemporaryDirectory() as root:
        for level in levels:
            at = filled(base, level) if lever == "particle_diameter_mm" else base
            at = overlay(at, {part: {place: level}})
            if "smaller" in own:
                at = overlay(at, of_two_sizes(level, own["smaller"]))
            runs = simulate(named(overlay(at, {"seed": seed}) for seed in seeds), root).values()
            flows = [r for r in runs if r is not None and not r.get("arched")]
            if kind in ("discharge", "heap"):  # a bed that did not come to rest is poured again
                for _ in range(len(runs) - len(flows)):
                    print(f"{kind},{quantity.name},,{quantity.unit},,1,{level},clogged")
            for found in flows if len(flows) > 1 else ():  # of one the spread is not known
                value = found[key] + own.get("misread", {}).get(level, 0.0)
                print(f"{kind},{quantity.name},{value:.4g},{quantity.unit},,,{level},")


if __name__ == "__main__":
    main(sys.argv[1])
