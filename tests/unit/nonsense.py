"""Files of nonsense, made by hand: what a laboratory, a spreadsheet or a power cut may hand in.

Each has a kind (the reader it is given to), a fault, and what the refusal must name.

A text is a sound one with one thing changed: `(fault, old, new, *named)`. The others are functions
that write the file.
"""

import io
import json
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import fuzz
import numpy as np
import openpyxl
import yaml
from PIL import Image
from scipy.io import wavfile

from calibration.chain.numerics import read_numerics
from calibration.engines.table import read_row
from calibration.errors import ConfigError
from calibration.intake.curves import read_curves
from calibration.intake.measurements import read_measured
from calibration.intake.photo import measure_photo
from calibration.intake.shear_tester import read_points
from calibration.intake.sound import read_train
from calibration.intake.tables import read_table
from calibration.runs.records import FOLDER, made_again, read_record
from calibration.runs.store import RunStore
from calibration.runs.verify import faults_of
from calibration.study.config import parse_config
from calibration.study.config.as_data import data_of
from calibration.study.factors import read_factors
from calibration.study.new.sizes import sieve_curve
from dem.io.checked import read_checked_arrays, sealed, write_checked_arrays
from dem.io.clump import read_clump
from dem.io.sieve import read_sizes
from dem.io.stl import read_stl
from dem.results import FAILED, RESULT
from dem.run import RunContext
from dem.spec import load_spec, parse_spec


@dataclass(frozen=True)
class Nonsense:
    """A file that must be refused: of which kind, what is wrong, what the refusal names, and
    write(path), which makes it."""

    kind: str
    fault: str
    named: tuple[str, ...]
    write: Callable[[Path], object]


NOT_TAKEN = "not taken"
"""What a reader says that leaves a damaged file of the project's own and makes it again."""


class LeftError(Exception):
    """A damaged file of the project's own was left, and that was told."""


def _numbers(path):
    return read_table(path).numbers("value")


def _configuration(path):
    folder = path.parent
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(MEASURED)
    with path.open(encoding="utf-8") as stream:
        data = data_of(stream)
    for key in ("factors", "measurements"):
        if isinstance(data, dict) and data.get(key) in ("factors.tsv", "measured.csv"):
            data[key] = str(folder / data[key])
    if not isinstance(data, dict):
        raise ConfigError("is no mapping", path=path, allowed="a YAML mapping of keys")
    return parse_config(data, files=[path])


def _checkpoint(path):
    """Read as a run resumes, which says why a checkpoint is not used."""
    path.replace(path.parent / "checkpoint.npz")
    said = []
    context = RunContext(
        parse_spec(yaml.safe_load(fuzz.SPEC)), path.parent, lambda fraction, text: said.append(text)
    )
    if context.resume() is None:
        raise LeftError(" ".join(said) or f"{NOT_TAKEN}: of another spec")


def _run(path, file):
    """Read as `calibration verify` reads it."""
    folder = RunStore(path.parent / "runs").folder(fuzz.RUN)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / file).write_bytes(path.read_bytes())
    store = RunStore(path.parent / "runs")
    taken = store.current(fuzz.RUN) or store.failure(fuzz.RUN)
    faults = [str(f) for f in faults_of(path.parent)]
    if faults and not taken:
        raise LeftError(" ".join(faults))


def _plan(path):
    folder = path.parent / "study" / "screening"
    folder.mkdir(parents=True, exist_ok=True)
    (folder.parent / FOLDER).mkdir(exist_ok=True)
    (folder / "plan.json").write_bytes(path.read_bytes())
    if faults := [str(f) for f in faults_of(path.parent) if "what it was planned" not in str(f)]:
        raise LeftError(" ".join(faults))


def _index(path):
    """A line of the index that is none is not taken: the run itself is looked at."""
    (path.parent / "index.jsonl").write_bytes(path.read_bytes())
    if RunStore(path.parent).known(fuzz.RUN) is None:
        raise LeftError(f"{NOT_TAKEN}")


def _record(path):
    folder = path.parent / "study"
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    (folder / "x.csv").write_text("a\n1\n")
    (folder / FOLDER / "screening.json").write_bytes(path.read_bytes())
    reason = made_again(folder, "screening", [folder / "x.csv"], "abc")
    if reason and read_record(folder / FOLDER / "screening.json") is None:
        raise LeftError(reason)


KINDS = {
    "configuration": (".yaml", _configuration),
    "factors": (".tsv", read_factors),
    "measured table": (".csv", read_measured),
    "workbook": (".xlsx", _numbers),
    "shear tester": (".csv", read_points),
    "curves": (".csv", lambda p: read_curves(p, "mass over time")),
    "design": (".csv", fuzz._design),
    "sieve table": (".csv", sieve_curve),
    "sizes": (".csv", lambda p: read_sizes(p, "mass")),
    "clump": (".csv", read_clump),
    "STL": (".stl", lambda p: read_stl(p, closed=True)),
    "photograph": (".png", measure_photo),
    "sound": (".wav", read_train),
    "numerics": (".yaml", lambda p: read_numerics(p, fuzz.FACTORS)),
    "run spec": (".yaml", load_spec),
    "responses": (".csv", lambda p: read_row(p, fuzz.RUN)),
    "metrics": (".json", fuzz.read_metrics),
    "checkpoint": (".npz", _checkpoint),
    "result": (".json", lambda p: _run(p, RESULT)),
    "failure": (".json", lambda p: _run(p, FAILED)),
    "plan": (".json", _plan),
    "index": (".jsonl", _index),
    "stamp": (".json", _record),
}
"""Kind: (end of its name, what reads it)."""

FACTORS = (
    "code\tname\tkey\tlow\thigh\n"
    "A\tfriction\tcontacts.particle_particle.static_friction\t0.2\t0.8\n"
    "B\trolling\tcontacts.particle_particle.rolling_friction\t0.02\t0.4\n"
    "C\tbounce\tcontacts.particle_particle.restitution\t0.2\t0.8\n"
)
MEASURED = (
    "experiment,quantity,value,unit\n"
    "heap,angle_of_repose,26.1,deg\n"
    "heap,angle_of_repose,28.4,deg\n"
    "heap,angle_of_repose,27.0,deg\n"
)
CONFIGURATION = """name: wheat
factors: factors.tsv
measurements: measured.csv
target: { metric: angle_of_repose_deg }
run:
  materials:
    particle: { density_kg_m3: 1350 }
  particles:
    diameter_mm: 4
screening: { kind: plackett_burman, runs: 12 }
"""
SHEAR = "normal_stress [kPa],shear_stress [kPa]\n1,0.8\n2,1.5\n4,2.9\n"
CURVES = "curve,x [s],y [g]\n" + "".join(
    f"{c},{k},{3 * k + c}\n" for c in range(4) for k in range(9)
)
DESIGN = (fuzz.ROOT / "data/paper/table06_plackett_burman.csv").read_text()
SIEVE = "diameter_mm,mass_percent\n1.0,20\n2.0,50\n3.0,30\n"
SIZES = "diameter_mm,passing_percent\n1.0,0\n2.0,40\n3.0,100\n"
CLUMP = "x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n1.0,0.2,0,0.8\n-3e-1,0.9,0.5,0.6\n"
MESH = """solid s
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid s
"""
SPEC = fuzz.SPEC.decode()
NUMERICS = """seeds: 5
points:
  low: { salt_salt_rolling_friction: 0.11 }
variants:
  full scale: { run: { particles: { count: 10000 } } }
  coarse: { against: full scale, run: { particles: { count: 2500 } } }
"""
RESPONSES = f"run_id,angle_of_repose_deg\n{fuzz.RUN},31.5\n"
METRICS = '{"angle_of_repose_deg": 31.5, "height_mm": 12}'

TEXTS = {
    "configuration": CONFIGURATION,
    "factors": FACTORS,
    "measured table": MEASURED,
    "shear tester": SHEAR,
    "curves": CURVES,
    "design": DESIGN,
    "sieve table": SIEVE,
    "sizes": SIZES,
    "clump": CLUMP,
    "STL": MESH,
    "run spec": SPEC,
    "numerics": NUMERICS,
    "responses": RESPONSES,
    "metrics": METRICS,
}
"""Kind: a sound file."""

CHANGED = {
    "configuration": [
        ("a key twice", "name: wheat", "name: wheat\nname: oats", "line 2", "oats"),
        ("a name that leaves the folder", "wheat", "../wheat", "line 1", "../wheat"),
        ("a word for a number", "1350", "heavy", "line 7", "heavy"),
        ("a list for a mapping", "{ metric: angle_of_repose_deg }", "[angle]", "line 4", "target"),
        ("infinity", "1350", ".inf", "line 7", "inf"),
        ("not a number", "diameter_mm: 4", "diameter_mm: .nan", "line 9", "nan"),
        ("minus a length", "diameter_mm: 4", "diameter_mm: -4", "line 9", "-4"),
        ("a tab", "  particles:", "\tparticles:", "line 8"),
        ("an alias of nothing", "name: wheat", "name: *wheat", "line 1"),
        ("an object of Python", "name: wheat", "name: !!python/name:os.system", "line 1"),
        ("a date for a number", "1350", "2024-01-05", "line 7", "2024"),
        ("a metric of nothing", "angle_of_repose_deg", "colour", "line 4", "colour"),
        ("an unknown section", "screening:", "sreening:", "line 10", "sreening"),
        ("half a run", "runs: 12", "runs: 12.5", "line 10", "12.5"),
        ("a design of minus runs", "runs: 12", "runs: -12", "line 10", "-12"),
        ("a missing table", "measured.csv", "none.csv", "none.csv"),
        ("a factor table of nothing", "factors.tsv", "none.tsv", "none.tsv"),
        ("no end of a bracket", "runs: 12 }", "runs: 12", "line 11"),
        ("a unit of another kind", "1350", "1350 mm", "line 7", "1350 mm"),
        ("a number for a run", CONFIGURATION[CONFIGURATION.index("run:") :], "run: 3\n", "line 5"),
        ("a key with a dot", "diameter_mm: 4", "diameter_mm: 4\nrun.particles: 3", "line 10"),
        ("a whole number that is no float", "1350", "1" + "0" * 400, "line 7", "1e+300"),
        ("a truth for a name", "name: wheat", "name: yes", "line 1", "name"),
        ("a number without end", "1350", "0x" + "f" * 5000, "line 7", "1,000 digits"),
    ],
    "factors": [
        ("a level of words", "0.2\t0.8\nB", "low\t0.8\nB", "line 2", "low"),
        ("infinity", "0.02\t0.4", "0.02\tinf", "line 3", "inf"),
        ("levels the same", "0.02\t0.4", "0.4\t0.4", "line 3", "0.4"),
        ("a code twice", "B\trolling", "A\trolling", "line 3", "A"),
        ("a name twice", "rolling\t", "friction\t", "line 3", "friction"),
        ("a key twice", "rolling_friction", "static_friction", "line 3", "static_friction"),
        ("a row too short", "\t0.02\t0.4", "\t0.02", "line 3"),
        ("a row too long", "0.02\t0.4", "0.02\t0.4\t1\t2", "line 3"),
        ("no rows", FACTORS[FACTORS.index("A\t") :], "", "nonsense.tsv"),
        ("a heading twice", "low\thigh", "low\tlow", "line 1", "low"),
        ("an empty name", "B\trolling", "B\t", "line 3", "name"),
        ("a number with a dash", "0.02\t0.4", "0.02\t0-4", "line 3", "0-4"),
    ],
    "measured table": [
        ("a negative angle", "28.4", "-28.4", "line 3", "-28.4"),
        ("a heap that overhangs", "28.4", "128.4", "line 3", "128.4"),
        ("not a number", "28.4", "nan", "line 3", "nan"),
        ("a word", "28.4", "steep", "line 3", "steep"),
        ("an error of a spreadsheet", "28.4", "#DIV/0!", "line 3", "#DIV/0!"),
        ("a formula", "28.4", "=A1+1", "line 3", "=A1+1"),
        ("a range", "28.4", "27-29", "line 3", "27-29"),
        ("a unit of nothing", "28.4,deg", "28.4,furlong", "line 3", "furlong"),
        ("an experiment of nothing", "heap,angle_of_repose,28.4", "pile,angle_of_repose,28.4",
         "line 3", "pile"),
        ("a row cut short", ",28.4,deg", "", "line 3"),
        ("a row too long", "28.4,deg", "28.4,deg,a,b", "line 3"),
        ("a quotation mark left open", "heap,angle_of_repose,28.4", '"heap,angle_of_repose,28.4',
         "line 3"),
        ("a zero byte", "28.4", "28\0.4", "nonsense.csv"),
        ("a number of a program", "28.4", "2_8.4", "line 3", "2_8.4"),
        ("a number without end", "28.4", "1" * 5000, "nonsense.csv"),
        ("a spread below zero", "unit\nheap,angle_of_repose,26.1,deg",
         "unit,sd,n\nheap,angle_of_repose,26.1,deg,-1,3", "line 2", "-1.0"),
        ("half a replicate", "unit\nheap,angle_of_repose,26.1,deg",
         "unit,sd,n\nheap,angle_of_repose,26.1,deg,1,2.5", "line 2", "2.5"),
        ("no rows", MEASURED[MEASURED.index("heap") :], "", "nonsense.csv"),
    ],
    "shear tester": [
        ("a minus load", "2,1.5", "-2,1.5", "line 3", "-2"),
        ("a minus stress", "2,1.5", "2,-1.5", "line 3", "-1.5"),
        ("a word", "2,1.5", "2,torn", "line 3", "torn"),
        ("a unit of another kind", "shear_stress [kPa]", "shear_stress [mm]", "line 2", "mm"),
        ("a gap", "2,1.5", ",1.5", "line 3"),
        ("no stress", "shear_stress", "temperature", "line 1"),
        ("infinity", "2,1.5", "2,inf", "line 3", "inf"),
        ("no rows", SHEAR[SHEAR.index("1,") :], "", "nonsense.csv"),
    ],
    "curves": [
        ("a word", "0,3,9\n", "0,3,nine\n", "line 5", "nine"),
        ("time that goes back", "0,3,9\n", "0,-3,9\n", "-3"),
        ("a curve of two points", "3,8,27\n", "3,8,27\n4,0,1\n4,1,2\n", "4"),
        ("no unit of time", "x [s]", "x [mm]", "line 1", "mm"),
        ("not a number", "0,3,9\n", "0,3,nan\n", "line 5", "nan"),
        ("no mass", "y [g]", "z [g]", "line 1"),
    ],
    "design": [
        ("a level of words", "1,1,1,-1,1,1,1,-1", "1,high,1,-1,1,1,1,-1", "line 3", "high"),
        ("a level beyond", "1,1,1,-1,1,1,1,-1", "1,7,1,-1,1,1,1,-1", "line 3", "7"),
        ("a factor of nothing", "run,A,", "run,Z,", "nonsense.csv", "A"),
        ("a factor twice", "run,A,B", "run,A,A", "line 2", "A"),
        ("a gap", "1,1,1,-1,1,1,1,-1", "1,,1,-1,1,1,1,-1", "line 3"),
        ("infinity", "1,1,1,-1,1,1,1,-1", "1,inf,1,-1,1,1,1,-1", "line 3", "inf"),
        ("no rows", DESIGN[DESIGN.index("\n1,") + 1 :], "", "nonsense.csv"),
    ],
    "sieve table": [
        ("too little in all", "2.0,50", "2.0,5", "55"),
        ("shares of one", "1.0,20\n2.0,50\n3.0,30", "1.0,0.2\n2.0,0.5\n3.0,0.3", "100"),
        ("a minus share", "1.0,20\n2.0,50", "1.0,-20\n2.0,90", "nonsense.csv"),
        ("a minus sieve", "2.0,50", "-2.0,50", "line 3", "-2.0"),
        ("a boulder", "2.0,50", "2e9,50", "line 3"),
        ("a word", "2.0,50", "2.0,half", "line 3", "half"),
        ("no shares", "mass_percent", "colour", "line 1", "colour"),
        ("no rows", SIEVE[SIEVE.index("1.0") :], "", "nonsense.csv"),
    ],
    "sizes": [
        ("sieves that descend", "2.0,40", "0.5,40", "line 3", "0.5"),
        ("a passing that falls", "2.0,40", "2.0,-4", "line 3", "-4.0"),
        ("no end", "3.0,100", "3.0,90", "line 4", "90.0"),
        ("no begin", "1.0,0", "1.0,5", "line 2", "5.0"),
        ("two kinds of share", "passing_percent", "passing_percent,fraction", "line 1"),
        ("a word", "2.0,40", "two,40", "line 3", "two"),
    ],
    "clump": [
        ("a radius of none", "1.0,0.2,0,0.8", "1.0,0.2,0,0", "line 3"),
        ("a minus radius", "1.0,0.2,0,0.8", "1.0,0.2,0,-0.8", "line 3", "-0.8"),
        ("a sphere inside another", "1.0,0.2,0,0.8", "0.1,0,0,0.2", "line 3"),
        ("a sphere far away", "1.0,0.2,0,0.8", "90,0.2,0,0.8", "line 3"),
        ("a sphere twice", "1.0,0.2,0,0.8", "0,0,0,1", "line 3"),
        ("a column more", "radius_mm\n", "radius_mm,colour\n", "line 2", "colour"),
        ("a gap", "1.0,0.2,0,0.8", "1.0,,0,0.8", "line 3"),
        ("no spheres", CLUMP[CLUMP.index("0,0,0") :], "", "nonsense.csv"),
        ("one grain of dust beside it", "1.0,0.2,0,0.8", "1.0,0,0,1e-9", "line 3"),
    ],
    "STL": [
        ("a corner of words", "vertex 1 0 0", "vertex one 0 0", "line 5"),
        ("a corner of two numbers", "vertex 1 0 0", "vertex 1 0", "line 5"),
        ("a corner of none", "vertex 1 0 0", "vertex nan 0 0", "line 5"),
        ("a facet without corners", "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "", "line 4"),
        ("four corners", "endloop", "vertex 1 1 0\nendloop", "line 7"),
        ("cut off", "endfacet\nendsolid s\n", "", "line 7"),
        ("a corner a kilometre away", "vertex 1 0 0", "vertex 2e6 0 0", "line 2"),
        ("a line for a triangle", "vertex 0 1 0", "vertex 2 0 0", "triangle"),
        ("open", "solid s\nfacet", "solid s\nfacet", "nonsense.stl"),
        ("a web page", MESH, "<!doctype html><title>404</title>", "nonsense.stl"),
    ],
    "run spec": [
        ("a word for a number", "count: 300", "count: many", "particles.count", "many"),
        ("minus grains", "count: 300", "count: -300", "particles.count", "-300"),
        ("half a grain", "count: 300", "count: 300.5", "particles.count", "300.5"),
        ("an experiment of nothing", "experiment: heap", "experiment: pile", "pile"),
        ("shares that make too much", "[0.5, 0.5]", "[0.5, 0.9]", "particles.sizes"),
        ("sizes without shares", "[0.5, 0.5]", "[0.5]", "particles.sizes"),
        ("a law of nothing", "cohesion: sjkr", "cohesion: glue", "laws.cohesion", "glue"),
        ("a law without its number", "{cohesion_energy_density_J_m3: 1.0e+4}", "{}",
         "cohesion_energy_density_J_m3"),
        ("a rate of none", "generation_rate_per_s: 600", "generation_rate_per_s: 0", "0"),
        ("a key of nothing", "seed: 1", "sede: 1", "sede"),
        ("a list", SPEC, "- 1\n- 2\n", "mapping"),
        ("an empty file", SPEC, "", "nonsense.yaml"),
        ("a number without end", "count: 300", "count: 1" + ":59" * 4000, "line 4", "1,000 digits"),
    ],
    "numerics": [
        ("no seeds", "seeds: 5", "seeds: 0", "line 1", "seeds"),
        ("seeds without end", "seeds: 5", "seeds: 99999999", "line 1", "99999999"),
        ("a factor of nothing", "salt_salt_rolling", "salt_pepper_rolling", "line 3",
         "salt_pepper_rolling_friction"),
        ("a level that is none", "0.11", ".nan", "line 3", "nan"),
        ("a variant of nothing", "against: full scale", "against: fine", "line 6", "fine"),
        ("no keys to lay over", "run: { particles: { count: 10000 } }", "", "line 5", "run"),
        ("a word for a run", "{ particles: { count: 2500 } }", "coarse", "line 6", "coarse"),
        ("no variants", "variants:\n", "variant:\n", "nonsense.yaml", "variant"),
        ("a list", NUMERICS, "- 1\n", "nonsense.yaml", "dictionary"),
        ("an object of Python", "seeds: 5", "seeds: !!python/name:os.system", "line 1"),
    ],
    "responses": [
        ("a word", "31.5", "steep", "line 2", "steep"),
        ("a run twice", "31.5\n", f"31.5\n{fuzz.RUN},30\n", "2, 3"),
        ("another run", fuzz.RUN, "heap-1", fuzz.RUN),
        ("no name of a run", "run_id", "run", "run_id"),
        ("infinity", "31.5", "inf", "line 2", "inf"),
    ],
    "metrics": [
        ("a word", "31.5", '"steep"', "angle_of_repose_deg", "steep"),
        ("infinity", "31.5", "1e999", "angle_of_repose_deg", "inf"),
        ("a truth", "31.5", "true", "angle_of_repose_deg", "True"),
        ("a list", METRICS, "[31.5]", "nonsense.json"),
        ("nothing", METRICS, "{}", "nonsense.json"),
        ("cut off", '12}', "", "nonsense.json"),
        ("a name twice", "height_mm", "angle_of_repose_deg", "angle_of_repose_deg"),
    ],
}  # fmt: skip

BYTES = {
    "an empty file": b"",
    "zeros": b"\0" * 300,
    "a picture": b"\x89PNG\r\n\x1a\n" + b"\0" * 60,
}
"""Handed to each kind that is a table of text."""


def _text(kind, old, new):
    def write(path):
        assert TEXTS[kind].count(old), f"{kind}: {old!r} is not in the sound file"
        path.write_text(TEXTS[kind].replace(old, new, 1), encoding="utf-8")

    return write


def _bytes(content):
    return lambda path: path.write_bytes(content)


def _book(*rows, change=None):
    def write(path):
        made = openpyxl.Workbook()
        for row in rows:
            made.active.append(row)
        if change:
            change(made)
        made.save(path)

    return write


def _far(made):
    made.active["XFD7"] = 1.0


def _second_sheet(made):
    made.create_sheet("two").append(["value", 1])


def _packed(names):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as packed:
        for name in names:
            packed.writestr(name, "<a/>")
    return out.getvalue()


OLD_BOOK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 99
GOOD_ROWS = (["experiment", "value"], ["heap", 26.1], ["heap", 27.4])
BOOKS = [
    ("no table", ("nonsense.xlsx",), _book()),
    ("two sheets", ("nonsense.xlsx", "two"), _book(*GOOD_ROWS, change=_second_sheet)),
    ("a cell in the last column", ("16384 columns",), _book(*GOOD_ROWS, change=_far)),
    ("a formula that was never counted", ("line 2", "=B9+1"),
     _book(GOOD_ROWS[0], ["heap", "=B9+1"])),
    ("an error of a spreadsheet", ("line 2",), _book(GOOD_ROWS[0], ["heap", "#REF!"])),
    ("a heading twice", ("value",), _book(["value", "value"], [1, 2])),
    ("a zip of something else", ("nonsense.xlsx",), _bytes(_packed(["a.txt"]))),
    ("a workbook cut off", ("nonsense.xlsx",), _bytes(fuzz._workbook()[:900])),
    ("an old workbook", ("nonsense.xlsx",), _bytes(OLD_BOOK)),
]  # fmt: skip


def _image(array, mode=None):
    def write(path):
        Image.fromarray(array, mode).save(path, "PNG")

    return write


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png(width, height):
    head = _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    body = _chunk(b"IDAT", zlib.compress(b"\0" * 10)) + _chunk(b"IEND", b"")
    return _bytes(b"\x89PNG\r\n\x1a\n" + head + body)


GREY = np.full((120, 160, 3), 128, np.uint8)
PHOTOGRAPHS = [
    ("nothing on it", ("nonsense.png",), _image(GREY)),
    ("noise", ("nonsense.png",),
     _image(np.random.default_rng(3).integers(0, 255, (120, 160, 3), np.uint8))),
    ("all black", ("nonsense.png",), _image(0 * GREY)),
    ("a box in place of a heap", ("nonsense.png",),
     _image(np.where(np.pad(np.ones((60, 80, 1), bool), ((40, 20), (40, 40), (0, 0))), 20, 230)
            .repeat(3, 2).astype(np.uint8))),
    ("one pixel", ("nonsense.png",), _image(GREY[:1, :1])),
    ("400 million pixels", ("64 million",), _png(20000, 20000)),
    ("no pixels", ("nonsense.png",), _png(0, 100)),
    ("a head and no picture", ("nonsense.png",), _png(160, 120)),
    ("cut off", ("nonsense.png",), _bytes(fuzz._picture()[:200])),
    ("text", ("nonsense.png",), _bytes(b"a photograph of a heap")),
    ("an empty file", ("nonsense.png",), _bytes(b"")),
]  # fmt: skip


def _wave(rate, samples):
    return lambda path: wavfile.write(path, rate, samples)


def _head(at, form, value):
    def write(path):
        data = bytearray(fuzz._sound())
        struct.pack_into(form, data, at, value)
        path.write_bytes(bytes(data))

    return write


SOUNDS = [
    ("silence", ("nonsense.wav",), _wave(8000, np.zeros(8000, np.int16))),
    ("noise", ("nonsense.wav",),
     _wave(8000, np.random.default_rng(3).normal(0, 3000, 16000).astype(np.int16))),
    ("one sample", ("nonsense.wav",), _wave(8000, np.ones(1, np.int16))),
    ("no samples", ("nonsense.wav",), _wave(8000, np.ones(0, np.int16))),
    ("a rate of none", ("nonsense.wav",), _head(24, "<I", 0)),
    ("a rate of gigahertz", ("nonsense.wav",), _head(24, "<I", 4_000_000_000)),
    ("a code of nothing", ("nonsense.wav",), _head(20, "<H", 77)),
    ("no channels", ("nonsense.wav",), _head(22, "<H", 0)),
    ("not a number", ("nonsense.wav",), _wave(8000, np.full(8000, np.nan, np.float32))),
    ("cut off in its head", ("nonsense.wav",), _bytes(fuzz._sound()[:20])),
    ("text", ("nonsense.wav",), _bytes(b"click click click")),
]  # fmt: skip


def _arrays(meta, **arrays):
    return lambda path: write_checked_arrays(path, arrays | {"meta": np.array(meta)})


def _checked():
    with tempfile.TemporaryDirectory() as folder:
        _arrays("{}", particles_position=np.zeros((2, 3)))(Path(folder) / "a.npz")
        read_checked_arrays(Path(folder) / "a.npz")
        return (Path(folder) / "a.npz").read_bytes()


WHY = ("checkpoint.npz",)
CHECKPOINTS = [
    ("cut off", WHY, _bytes(_checked()[:-40])),
    ("a byte more", WHY, _bytes(_checked() + b"\0")),
    ("an empty file", WHY, _bytes(b"")),
    ("text", WHY, _bytes(b"the state of a run")),
    ("no words about it", WHY, lambda p: write_checked_arrays(p, {"a": np.zeros(3)})),
    ("words that are no JSON", WHY, _arrays("{", a=np.zeros(3))),
    ("words that are a list", WHY, _arrays("[1]", a=np.zeros(3))),
    ("words without a key", WHY, _arrays("{}", a=np.zeros(3))),
    ("of another run", (NOT_TAKEN,), _arrays('{"key": ["other"], "frames": 0}', a=np.zeros(3))),
    ("objects of Python", WHY,
     lambda p: write_checked_arrays(p, {"a": np.array([{}], object), "meta": np.array("{}")})),
]  # fmt: skip


def _json(data, fits=True):
    return _bytes(json.dumps(sealed(data) if fits else data).encode())


SOUND_RESULT = fuzz.ABOUT | fuzz.MADE | fuzz.MANIFEST
SOUND_FAILURE = fuzz.MADE | fuzz.MANIFEST | {"error": "blown up", "kind": "DemError"}
PARTS = [
    ("without a checksum", lambda d: _json(d, fits=False)),
    ("of another checksum", lambda d: _json(d | {"checksum": "0" * 64}, fits=False)),
    ("a list", lambda d: _bytes(b"[1, 2]")),
    ("cut off", lambda d: _bytes(json.dumps(sealed(d)).encode()[:-30])),
    ("without a manifest", lambda d: _json({k: v for k, v in d.items() if k != "manifest"})),
    ("a word for a manifest", lambda d: _json(d | {"manifest": "mine"})),
    ("another run's",
     lambda d: _json(d | {"manifest": d["manifest"] | {"run": f"heap-{'f' * 16}"}})),
    ("a file that is not there",
     lambda d: _json(d | {"manifest": d["manifest"] | {"files": {"final.npz": "0"}}})),
    ("a file outside",
     lambda d: _json(d | {"manifest": d["manifest"] | {"files": {"../../etc": "0"}}})),
    ("an engine of no name", lambda d: _json(d | {"engine": 7})),
    ("a word for its metrics", lambda d: _json(d | {"metrics": "steep"})),
    ("a hundred thousand brackets", lambda d: _bytes(b"[" * 100_000)),
]  # fmt: skip

SOUND_PLAN = {fuzz.RUN: yaml.safe_load(fuzz.SPEC)}
PLANS = [
    ("a list", _bytes(b"[1]")),
    ("cut off", _bytes(json.dumps(SOUND_PLAN).encode()[:-9])),
    ("specs of words", _json({fuzz.RUN: "a heap"}, fits=False)),
    ("a name that leaves the folder", _json({"../../x": SOUND_PLAN[fuzz.RUN]}, fits=False)),
    ("a name of another spec", _json(SOUND_PLAN, fits=False)),
    ("a spec of nothing", _json({fuzz.RUN: {}}, fits=False)),
    ("grains of words", _json({fuzz.RUN: SOUND_PLAN[fuzz.RUN] | {"particles": "many"}}, False)),
    ("zeros", _bytes(b"\0" * 50)),
    ("a mesh of nothing",
     _json({fuzz.RUN: SOUND_PLAN[fuzz.RUN] | {"geometry": {"plate_stl": "none.stl"}}}, False)),
]  # fmt: skip

ENTRY = {"run": fuzz.RUN, "engine": "a", "wall_time_s": 1.0, "files": {"result.json": [1, 2, 3, 4]}}
LINES = [
    ("cut off", json.dumps(ENTRY)[:-9]),
    ("no end of the line", json.dumps(ENTRY)),
    ("a list", "[1]\n"),
    ("a word", "run\n"),
    ("no files", json.dumps({k: v for k, v in ENTRY.items() if k != "files"}) + "\n"),
    ("files of words", json.dumps(ENTRY | {"files": "all"}) + "\n"),
    ("a zero in a name", json.dumps(ENTRY | {"files": {"a\0": 1}}) + "\n"),
    ("another run", json.dumps(ENTRY | {"run": "heap-0"}) + "\n"),
    ("a run of no name", json.dumps(ENTRY | {"run": 7}) + "\n"),
]

SOUND_STAMP = {"made_from": "abc", "files": {"x.csv": "0"}, "inputs": {}}
STAMPS = [
    ("without a checksum", _json(SOUND_STAMP, fits=False)),
    ("a list", _bytes(b"[]")),
    ("cut off", _bytes(json.dumps(sealed(SOUND_STAMP)).encode()[:-5])),
    ("files of words", _json(SOUND_STAMP | {"files": "all"})),
    ("a digest of a number", _json(SOUND_STAMP | {"files": {"x.csv": 3}})),
    ("a zero in a name", _json(SOUND_STAMP | {"inputs": {"a\0": "0"}})),
    ("made from nothing", _json(SOUND_STAMP | {"made_from": None})),
    ("a hundred thousand brackets", _bytes(b"[" * 100_000)),
]


def _corpus():
    for kind, cases in CHANGED.items():
        for fault, old, new, *named in cases:
            yield Nonsense(kind, fault, tuple(named), _text(kind, old, new))
    tables = ("factors", "measured table", "shear tester", "curves", "design", "sieve table",
              "sizes", "clump", "STL", "responses")  # fmt: skip
    for kind in tables:
        for fault, content in BYTES.items():
            yield Nonsense(kind, fault, (f"nonsense{KINDS[kind][0]}",), _bytes(content))
    for kind, cases in (("workbook", BOOKS), ("photograph", PHOTOGRAPHS), ("sound", SOUNDS),
                        ("checkpoint", CHECKPOINTS)):  # fmt: skip
        for fault, named, write in cases:
            yield Nonsense(kind, fault, named, write)
    for fault, make in PARTS:
        yield Nonsense("result", fault, (fuzz.RUN,), make(SOUND_RESULT))
        if fault != "a word for its metrics":  # a failure has none
            yield Nonsense("failure", fault, (fuzz.RUN,), make(SOUND_FAILURE))
    for fault, write in PLANS:
        yield Nonsense("plan", fault, ("plan.json",), write)
    for fault, line in LINES:
        yield Nonsense("index", fault, (NOT_TAKEN,), _bytes(line.encode()))
    for fault, write in STAMPS:
        yield Nonsense("stamp", fault, ("nothing says how they were made",), write)


CORPUS = tuple(_corpus())


def refusal(case: Nonsense, folder: Path) -> str | None:
    """What is said of a file; None where it was taken in silence. Anything but an error in a
    sentence goes through."""
    end, read = KINDS[case.kind]
    path = folder / f"nonsense{end}"
    case.write(path)
    try:
        read(path)
    except (fuzz.CalibrationError, fuzz.DemError, LeftError) as error:
        return str(error)
    return None


def sound(kind: str, folder: Path) -> None:
    """Read the sound file of a kind, which must be taken."""
    end, read = KINDS[kind]
    path = folder / f"sound{end}"
    path.write_text(TEXTS[kind], encoding="utf-8")
    with suppress(LeftError):
        read(path)
