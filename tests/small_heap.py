"""A heap of 400 grains that LIGGGHTS and LAMMPS pour too, in seconds of one core."""

from benchmarks.rates.foreign_studies import RUN

SPEC = {"experiment": "heap", "seed": 1, **RUN}
