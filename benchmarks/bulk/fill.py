"""Fills a silo where its grains' places are not at hand: `python -m
benchmarks.bulk.fill FILES`.

The benchmark gives the places of 100,000 grains that were poured; they are large files. This rains
as many into the closed silo, soft and at a long step first, then as they are, and writes the file
that the case reads. Its packing is another than the authors', so that its flow can be compared and
not each grain.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.bulk.cases import COARSE, MATERIALS, SILOS, silo, silo_file
from benchmarks.bulk.codes import simulation
from dem.errors import DemError
from dem.io.files import replace_file
from dem.simulation import Simulation

GRAINS = 100_000
SOFTER = 100.0
"""Young's moduli over those of the first settling: its step is ten times as long."""
LOOK, LONGEST = 0.05, 4.0
"""Time between two looks at a settling, and the longest that it may take [s]."""
REST = 1e-3
"""Largest speed [m/s] that 99 of 100 grains have at the end."""


def lattice(orifice: str, count: int, seed: int = 1) -> np.ndarray:
    """Places (n, 3) [m] of grains over the cone of a silo, in jittered layers."""
    height, opening = SILOS[orifice]
    bottom, pitch, wide = height + 0.1 - opening + 2 * COARSE, 2.1 * COARSE, 0.1 - 1.1 * COARSE
    line = np.arange(-wide, wide, pitch)
    sites = np.array([(x, y) for x in line for y in line if np.hypot(x, y) < wide])
    layer, site = np.divmod(np.arange(count), len(sites))
    jitter = np.random.default_rng(seed).uniform(-0.045, 0.045, (count, 3)) * COARSE
    return np.column_stack([sites[site], bottom + layer * pitch]) + jitter


def filled(folder: Path, orifice: str, material: str, count: int = GRAINS) -> np.ndarray:
    """Places (n, 3) [m] of grains at rest in the closed silo. Raises DemError where they do not
    come to rest or the silo is too low for them."""
    places = lattice(orifice, count)
    case = silo(folder, orifice, material, places)
    if places[:, 2].max() > case.triangles[..., 2].max():
        raise DemError(f"{count} grains do not fit over the cone of the silo; fewer are allowed")
    for softer in (SOFTER, 1.0):
        sim = simulation(case, softer=softer, closed=SILOS[orifice])
        _settle(sim)
        places = sim.position[np.argsort(sim.tag)]
        case = silo(folder, orifice, material, places)
    return places


def _settle(sim: Simulation) -> None:
    while sim.time < LONGEST:
        sim.advance(round(LOOK / sim.time_step))
        speed = float(np.quantile(np.linalg.norm(sim.velocity, axis=1), 0.99))
        if speed < REST:
            return
    raise DemError(
        f"after {LONGEST:g} s the grains still move at {speed:.2g} m/s; allowed: {REST:g}"
    )


def main(words: list[str] | None = None) -> int:
    """Fill the silos that are asked for; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bulk.fill")
    parser.add_argument("files", type=Path, help="folder of the benchmark's files")
    parser.add_argument("--orifice", choices=SILOS, action="append", required=True)
    parser.add_argument("--material", choices=[m for m in MATERIALS if m != "steel"], default="M1")
    parser.add_argument("--grains", type=int, default=GRAINS)
    args = parser.parse_args(words)
    for orifice in args.orifice:
        path = silo_file(args.files, orifice, args.material)
        try:
            places = filled(args.files, orifice, args.material, args.grains)
        except DemError as fault:
            print(fault, file=sys.stderr)
            return 1
        replace_file(path, partial(np.savetxt, X=places, fmt="%.12g"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
