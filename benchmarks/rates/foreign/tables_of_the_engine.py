"""Tables of heaps, shear cells, bulk densities and a silo by this project's own engine, as they lie
beside this file: `python -m benchmarks.rates.foreign.tables_of_the_engine NAME` prints one.

Nature has a step of three quarters of the diagnosis' own (pressed grains have a shorter one than
others), seeds of its own and coefficients within the table of factors, with a law that the study
lacks or without one. All of this, and what `engine_tables.py` expects of each table, stood before
the first run was made. Three things were mended before a table of these was diagnosed: at the step
of heaps sheared grains tremble, 0.1 J/m2 among them is less than their readings scatter, and of a
silo with 0.02 J/m2 three quarters of the tests clog. One was mended after: vessels held as many
grains of each size, where the study fills them as high, and the one without a law was not met. A
silo whose grains stand over the orifice at the end was `clogged`, whatever had left before.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from benchmarks.rates.foreign import heaps_of_liggghts
from benchmarks.rates.foreign_studies import DENSITIES, HEAPS, SHEARS, SILOS, filled
from calibration.intake.quantities import LEVERS, QUANTITIES, measurable
from calibration.runs.simulated import named, simulate
from calibration.study.config import overlay

SEEDS = range(101, 106)
STEPS = {"shear": 0.15, "bulk_density": 0.3, "discharge": 0.3, "heap": 0.3}  # of the Rayleigh step
LOADS = ("normal_stress_kPa", (0.4, 0.8, 1.5, 3.0, 6.0))
SIZES = ("particle_diameter_mm", (2.0, 2.5, 3.0, 3.6, 4.4))
COARSE = ("particle_diameter_mm", heaps_of_liggghts.SIZES)
ORIFICES = ("orifice_diameter_mm", (10.4, 11.0, 11.5, 12.0, 12.5, 13.0))


def jkr(energy):
    """Cohesion of so many J/m2, told and as keys of a run spec."""
    keys = {"laws": {"cohesion": "jkr"}, "law_parameters": {"surface_energy_J_m2": energy}}
    return f"cohesion of {energy:g} J/m2 (JKR)", keys


FALLING = (
    "friction of 0.8 (F / 0.05 mN)^-0.15",
    {
        "laws": {"friction": "stress_dependent"},
        "law_parameters": {"friction_exponent": 0.15, "friction_reference_force_N": 5e-5},
        "contacts": {"particle_particle": {"static_friction": 0.8}},
    },
)
LONG = "grains of two bonded spheres, 1.4 times as long as wide", {"particles": {"elongation": 1.4}}
OPENED = "out of a funnel that is filled, then opened", {"geometry": {"feed": "opened"}}
NOTHING: tuple[str, dict] = ("no further law", {})


def of_two_sizes(diameter):
    """Grains of two sizes, half by number, of the volume together that the stated one has."""
    small, large = 0.8 * diameter, (2.0 - 0.8**3) ** (1.0 / 3.0) * diameter
    return {"particles": {"sizes": {"diameters_mm": [small, large], "fractions": [0.5, 0.5]}}}


@dataclass(frozen=True)
class Table:
    """What a table is of: the study, the lever and its levels, what nature has beside it, at a
    level, and by how much readings of a level are off."""

    study: dict
    levels: tuple
    nature: tuple = field(default=NOTHING)
    at: Callable[[float], dict] = lambda level: {}
    off: Mapping[float, float] = field(default_factory=dict)


TABLES = {
    "shear_dry": Table(SHEARS, LOADS),
    "shear_cohesive": Table(SHEARS, LOADS, jkr(0.4)),
    "shear_falling": Table(SHEARS, LOADS, FALLING),
    "density_dry": Table(DENSITIES, SIZES),
    "density_cohesive": Table(DENSITIES, SIZES, jkr(0.02)),
    "silo_clogged": Table(SILOS, ORIFICES, jkr(0.01)),
    "heaps_long": Table(HEAPS, COARSE, LONG),
    "heaps_opened": Table(HEAPS, COARSE, OPENED),
    "heaps_two_sizes": Table(HEAPS, COARSE, ("two sizes, 0.8 and 1.14 of it", {}), of_two_sizes),
    "heaps_read_low": Table(HEAPS, COARSE, ("5 mm read 4 deg too low", {}), off={5.0: -4.0}),
}


def main(name):
    """Print a table, a line a run."""
    own = TABLES[name]
    ((_, test),) = own.study["tests"].items()
    kind, (lever, levels) = test["experiment"], own.levels
    told, law = own.nature
    quantity = QUANTITIES[kind]
    key = measurable(kind)[quantity.name].key
    part, place = LEVERS[lever].place
    step = STEPS[kind]
    seeds = f"seeds {SEEDS[0]} to {SEEDS[-1]}"
    print(f"# By this project's engine, {told}, {100 * step:g} % of the Rayleigh step, {seeds}:")
    print(f"# tables_of_the_engine.py {name}.")
    print(f"experiment,quantity,value,unit,sd,n,{lever},outcome")
    with tempfile.TemporaryDirectory() as root:
        for level in levels:
            base = overlay(test["run"], overlay(law, {"numerics": {"rayleigh_fraction": step}}))
            if lever == "particle_diameter_mm":
                base = filled(base, level)
            base = overlay(overlay(base, {"experiment": kind, part: {place: level}}), own.at(level))
            specs = named(overlay(base, {"seed": seed}) for seed in SEEDS)
            runs = list(simulate(specs, root).values())
            flows = [r for r in runs if r is not None and not r.get("arched")]
            if kind in ("discharge", "heap"):  # a bed that did not come to rest is poured again
                for _ in range(len(runs) - len(flows)):
                    print(f"{kind},{quantity.name},,{quantity.unit},,1,{level},clogged")
            for found in flows if len(flows) > 1 else ():  # of one the spread is not known
                read = found[key] + own.off.get(level, 0.0)
                print(f"{kind},{quantity.name},{read:.4g},{quantity.unit},,,{level},")


if __name__ == "__main__":
    main(sys.argv[1])
