"""Readers of what users write, under inputs that were changed at random: `python tests/unit/fuzz.py
100000 [SEED]`.

A mutation is drawn from a seeded generator, so that each case can be made again: `mutated(text,
seed)`.
"""

import random
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

from calibration.errors import CalibrationError
from calibration.intake.measurements import read_measured
from calibration.statistics.screening_design import screening_design
from calibration.study.config.as_data import data_of
from calibration.study.config.schema import ScreeningConfig
from calibration.study.factors import read_factors
from dem.errors import DemError
from dem.io.clump import read_clump
from dem.io.sieve import read_sizes
from dem.io.stl import read_stl, write_stl
from dem.spec import load_spec
from diagnosis.settings import read_settings

ROOT = Path(__file__).parents[2]
TOKENS = [
    b"nan", b"-inf", b"1e999", b"-1", b"0", b"1" * 400, b"", b"\0", b"\xff\xfe", "é²½".encode(),
    b"\t", b",", b";",
    b'"', b"'", b"\n", b"\r\n", b"#", b"=1+1", b"[", b"]", b"{", b"}", b": ", b"- ", b"&a ", b"*a",
    b"!!int ",
    b"!!bool ", b"!!python/name:os.system", b"? ", b"<<: ", b"null", b"true", b"2020-01-01",
    b"0x1f", b"1_000", b"\xe2\x80\xa8",
    b"solid", b"vertex 1 2", b"1,5", b"5 kg", b"%", b"|", b">", b"  ",
]  # fmt: skip


def mutated(content, seed):
    """`content` (bytes) after one to four random changes."""
    rng, data = random.Random(seed), bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        end = min(len(data), at + rng.choice([1, 1, 2, 5, 20, 200]))
        change = rng.randrange(6)
        if change == 0:
            del data[at:end]
        elif change == 1:
            data[at:at] = rng.choice(TOKENS)
        elif change == 2:
            data[at:end] = rng.choice(TOKENS)
        elif change == 3:
            data[at:at] = data[at:end] * rng.choice([1, 1, 3])
        elif change == 4 and data:
            data[min(at, len(data) - 1)] = rng.randrange(256)
        else:
            _swap_words(data, rng)
    return bytes(data)


def _swap_words(data, rng):
    """A word of the text, such as a number or a key, gives way to a token or to another word of
    it."""
    words = bytes(data).split()
    if words:
        old, new = rng.choice(words), rng.choice([*TOKENS, rng.choice(words)])
        data[:] = bytes(data).replace(old, new, 1)


def _mesh():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    with tempfile.NamedTemporaryFile(suffix=".stl") as file:
        write_stl(file.name, corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]))
        return Path(file.name).read_bytes()


ASCII_MESH = b"solid s\n" + b"".join(
    b"facet normal 0 0 1\nouter loop\n"
    b"vertex %d 0 0\nvertex 1 %d 0\nvertex 0 1 1\nendloop\nendfacet\n" % (n, n + 2)
    for n in range(4)
)
SPEC = b"""experiment: heap
seed: 1
particles:
  count: 300
  diameter_mm: 4.0
  sizes: {by: mass, diameters_mm: [2.0, 4.0], fractions: [0.5, 0.5]}
laws: {cohesion: sjkr}
law_parameters: {cohesion_energy_density_J_m3: 1.0e+4}
geometry: {orifice_diameter_mm: 20, generation_rate_per_s: 600}
"""


def _configuration(path):
    with path.open(encoding="utf-8") as stream:  # as snakemake opens it
        data_of(stream)


def _design(path):
    rules = ScreeningConfig(design=str(path))
    screening_design(read_factors(ROOT / "config" / "factors.tsv"), rules)


READERS = {
    "measurements": ("data/paper/measurements.csv", read_measured),
    "readings": ("examples/soybean/measured.csv", read_measured),
    "factors": ("config/factors.tsv", read_factors),
    "diagnosis settings": ("config/diagnosis.yaml", read_settings),
    "configuration": ("config/config.yaml", _configuration),
    "run spec": (SPEC, load_spec),
    "design table": ("data/paper/table06_plackett_burman.csv", _design),
    "sizes": (
        b"# a sieve\ndiameter_mm,passing_percent\n1.0,0\n2.0,40\n3.0,100\n",
        lambda p: read_sizes(p, "mass"),
    ),
    "clump": (b"x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n1.0,0.2,0,0.8\n-3e-1,0.9,0.5,0.6\n", read_clump),
    "binary mesh": (_mesh(), read_stl),
    "mesh": (ASCII_MESH, lambda p: read_stl(p, closed=True)),
}
"""Name: (a valid input or the path of one, what reads the path of such a file)."""


def faults(name, seeds, folder):
    """[(seed, kind, traceback)] of the seeds whose input leads to anything but success or an error
    in a sentence."""
    source, read = READERS[name]
    content = (ROOT / source).read_bytes() if isinstance(source, str) else source
    path, found = Path(folder) / "input", []
    for seed in seeds:
        path.write_bytes(mutated(content, seed))
        try:
            read(path)
        except (CalibrationError, DemError) as error:
            if len(str(error)) > 4000:
                found.append((seed, "long message", str(error)[:400]))
        except Exception as error:
            found.append((seed, type(error).__name__, traceback.format_exc()))
    return found


def main(total, first=0):
    """Try `total` inputs, shared among the readers, and print what went wrong, a traceback of each
    kind."""
    count = total // len(READERS)
    with tempfile.TemporaryDirectory() as folder:
        for name in READERS:
            found = faults(name, range(first, first + count), folder)
            kinds = Counter(kind for _, kind, _ in found)
            print(f"{name}: {count} inputs, {len(found)} faults {dict(kinds)}", flush=True)
            for kind in kinds:
                seed, _, text = next(f for f in found if f[1] == kind)
                print(f"--- seed {seed}\n{text}")


if __name__ == "__main__":
    main(int(sys.argv[1]), *map(int, sys.argv[2:3]))
