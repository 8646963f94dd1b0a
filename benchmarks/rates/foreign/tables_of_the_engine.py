"""Tables of heaps, shear cells, bulk densities and a silo by this project's own engine, as they lie
beside this file: `python -m benchmarks.rates.foreign.tables_of_the_engine NAME` prints one."""

import sys
import tempfile

from benchmarks.rates.engine_tables import EXPECTED
from benchmarks.rates.foreign_studies import filled, read
from calibration.intake.quantities import LEVERS, QUANTITIES, measurable
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay

SEEDS = range(101, 106)
NATURE = read("nature.yaml")
TABLES = NATURE["by_this_engine"]


def of_two_sizes(diameter, smaller):
    """Grains of two sizes, half by number, of the volume together that the stated one has."""
    sizes = [smaller * diameter, (2.0 - smaller**3) ** (1.0 / 3.0) * diameter]
    return {"particles": {"sizes": {"diameters_mm": sizes, "fractions": [0.5, 0.5]}}}


def main(name):
    """Print a table, a line a run."""
    own = TABLES[name]
    ((_, test),) = EXPECTED[name].study["tests"].items()
    ((lever, levels),) = own["levels"].items()
    kind, told = test["experiment"], own.get("told", "no further law")
    quantity = QUANTITIES[kind]
    key = measurable(kind)[quantity.name].key
    part, place = LEVERS[lever].place
    step = NATURE["steps"][kind]
    seeds = f"seeds {SEEDS[0]} to {SEEDS[-1]}"
    print(f"# By this project's engine, {told}, {100 * step:g} % of the Rayleigh step, {seeds}:")
    print(f"# tables_of_the_engine.py {name}.")
    print(f"experiment,quantity,value,unit,sd,n,{lever},outcome")
    with tempfile.TemporaryDirectory() as root:
        for level in levels:
            base = overlay(test["run"], {"numerics": {"rayleigh_fraction": step}})
            base = overlay(base, own.get("run", {}))
            if lever == "particle_diameter_mm":
                base = filled(base, level)
            base = overlay(base, {"experiment": kind, part: {place: level}})
            if "smaller" in own:
                base = overlay(base, of_two_sizes(level, own["smaller"]))
            specs = named(overlay(base, {"seed": seed}) for seed in SEEDS)
            runs = list(simulate(specs, root).values())
            flows = [r for r in runs if r is not None and not r.get("arched")]
            if kind in ("discharge", "heap"):  # a bed that did not come to rest is poured again
                for _ in range(len(runs) - len(flows)):
                    print(f"{kind},{quantity.name},,{quantity.unit},,1,{level},clogged")
            for found in flows if len(flows) > 1 else ():  # of one the spread is not known
                value = found[key] + own.get("misread", {}).get(level, 0.0)
                print(f"{kind},{quantity.name},{value:.4g},{quantity.unit},,,{level},")


if __name__ == "__main__":
    main(sys.argv[1])
