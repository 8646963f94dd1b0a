"""Readers of what users write, under inputs that were changed at random: `python tests/unit/fuzz.py
100000 [SEED]`, from the project's folder, with a limit of memory and of time for each input.

A mutation is drawn from a seeded generator, so that each case can be made again: `mutated(text,
seed)`. Files of a structure are changed within it: a part of a workbook is packed again, a chunk of
a picture gets its checksum, so that the readers behind the library's own checks are reached.
"""

import hashlib
import io
import json
import os
import random
import resource
import signal
import struct
import sys
import tempfile
import traceback
import zipfile
import zlib
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np
import openpyxl
import yaml
from PIL import Image
from scipy.io import wavfile

from calibration.chain.numerics import read_numerics
from calibration.engines.command import read_metrics
from calibration.engines.table import read_row
from calibration.errors import CalibrationError
from calibration.intake.curves import read_curves
from calibration.intake.measurements import read_measured
from calibration.intake.photo import measure_photo
from calibration.intake.shear_tester import read_points
from calibration.intake.sound import read_train
from calibration.intake.started_code import remembered
from calibration.intake.tables import read_table
from calibration.runs.all_runs import planned
from calibration.runs.plans import read_metric
from calibration.runs.records import FOLDER, altered, changed_inputs, made_again, recorded
from calibration.runs.store import RunStore
from calibration.runs.verify import faults_of, plan_faults, short_batches
from calibration.statistics.screening_design import screening_design
from calibration.study.config.as_data import data_of
from calibration.study.config.resolution import parse_resolved
from calibration.study.config.schema import ScreeningConfig
from calibration.study.factors import read_factors
from calibration.study.new.answers import read_entries
from calibration.study.new.laboratory_table import read_filled, write_empty
from calibration.study.new.methods import methods
from calibration.study.new.sizes import sieve_curve
from dem.errors import DemError
from dem.io.checked import DIGEST, sealed, write_checked_arrays
from dem.io.clump import read_clump
from dem.io.sieve import read_sizes
from dem.io.stl import read_stl, write_stl
from dem.results import FAILED, RESULT
from dem.run import RunContext
from dem.spec import load_spec, parse_spec
from diagnosis.settings import read_settings

ROOT = Path(__file__).parents[2]
FACTORS = [f.name for f in read_factors(ROOT / "config" / "factors.tsv")]
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


ASCII_MESH = (
    b"solid s\n"
    + b"".join(
        b"facet normal 0 0 1\nouter loop\n"
        b"vertex %d 0 0\nvertex 1 %d 0\nvertex 0 1 1\nendloop\nendfacet\n" % (n, n + 2)
        for n in range(4)
    )
    + b"endsolid s\n"
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
        data = data_of(stream)
    parse_resolved(data, [path])


def restated(content, seed):
    """A YAML file with one or two of its values changed, whatever the schema asks for, or its
    text."""
    rng = random.Random(seed)
    if rng.random() < 0.3:
        return mutated(content, seed)
    data = yaml.safe_load(content)
    for holder, key in rng.sample(list(_places(data)), rng.randint(1, 2)):
        with suppress(KeyError, IndexError, TypeError):
            holder[key] = rng.choice([_odd(rng), 10**400, "\ud800", "1 mm", ["a"]])
    if "run" in data and rng.random() < 0.3:
        data["resolution"] = rng.choice(["quick", "test", [1]])
    return yaml.safe_dump(data).encode(errors="replace")


def _index(path):
    """The index of a store of runs, whose lines a power cut may have left half."""
    (path.parent / "index.jsonl").write_bytes(path.read_bytes())
    store = RunStore(path.parent)
    store.known("heap-0123456789abcdef")
    with suppress(DemError):
        store.result("heap-0123456789abcdef")


def _sealed_file(*parts):
    """A JSON file of the project's own, whose checksum fits."""
    return json.dumps(sealed({k: v for part in parts for k, v in part.items()}), indent=2).encode()


RUN = "heap-0123456789abcdef"
MADE = {"engine": "0123456789abcdef", "metrics": {"angle_of_repose_deg": 31.5}}
MANIFEST = {"manifest": {"run": RUN, "inputs": {}, "software": {"numba": "0"}, "files": {}}}
ABOUT = {"experiment": "heap", "seed": 1, "spec": {"seed": 1}, "numerics": {"wall_time_s": 1.0}}


def resealed(content, seed):
    """A JSON file with one of its values, or its text, changed; two times of three its checksum
    fits again, so that what stands behind the check is reached."""
    rng = random.Random(seed)
    if rng.random() < 0.3:
        return mutated(content, seed)
    data = json.loads(content)
    places = list(_places(data))
    for holder, key in rng.sample(places, rng.randint(1, 2)):
        with suppress(KeyError, IndexError, TypeError):
            if rng.random() < 0.2:
                del holder[key]
            else:
                holder[key] = _odd(rng)
    if "checksum" in data and rng.random() < 0.8:
        data = sealed({k: v for k, v in data.items() if k != "checksum"})
    return json.dumps(data).encode()


def _places(data):
    """(holder, key) of each value inside a mapping or a list, at whatever depth."""
    for key in list(data) if isinstance(data, dict) else range(len(data)):
        yield data, key
        if isinstance(data[key], dict | list):
            yield from _places(data[key])


def _odd(rng):
    odd = [None, True, -1, 0, 1e300, float("nan"), 10**30, "", "\0", "../..", "=1+1", "x" * 5000,
           [], [[]], [1, "a"], {}, {"": None}, {"../x": {}}]  # fmt: skip
    return rng.choice(odd)


def rechecked(content, seed):
    """A checkpoint with one of its arrays, or its bytes, changed; most times its checksum fits."""
    rng = random.Random(seed)
    inside = content[:-DIGEST]
    if rng.random() < 0.3:
        return mutated(content, seed)
    if rng.random() < 0.5:
        inside = mutated(inside, seed)
    else:
        with suppress(ValueError, KeyError, zipfile.BadZipFile):
            inside = repacked(inside, seed)
    return inside + hashlib.sha256(inside).digest()


def _checkpoint():
    arrays = {"particles_position": np.zeros((3, 3)), "meta": np.array('{"key": [], "frames": 0}')}
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        write_checked_arrays(file.name, arrays)
        return Path(file.name).read_bytes()


def _resume(path):
    """A checkpoint is used or left, and never ends a run."""
    path.replace(path.parent / "checkpoint.npz")
    RunContext(parse_spec(yaml.safe_load(SPEC)), path.parent).resume()


def _run_of(path, file):
    """A run's files below a store, read by all that reads them."""
    store = RunStore(path.parent / "runs")
    store.folder(RUN).mkdir(parents=True, exist_ok=True)
    (store.root / "index.jsonl").unlink(missing_ok=True)
    for old in (RESULT, FAILED):
        (store.folder(RUN) / old).unlink(missing_ok=True)
    (store.folder(RUN) / file).write_bytes(path.read_bytes())
    store.current(RUN)
    store.failure(RUN)
    store.known(RUN)
    for fault in faults_of(path.parent):
        str(fault)
    with suppress(DemError):
        store.entry(RUN, full=True)
    with suppress(CalibrationError, DemError):
        read_metric([RUN], "angle_of_repose_deg")


def _plan(path):
    """A plan, as the start of the workflow and `verify` read it."""
    folder = path.parent / "study" / "screening"
    folder.mkdir(parents=True, exist_ok=True)
    (folder.parent / FOLDER).mkdir(exist_ok=True)
    (folder / "plan.json").write_bytes(path.read_bytes())
    list(plan_faults(folder))
    for fault in faults_of(path.parent):
        str(fault)
    with suppress(ValueError):
        planned(path.parent / "study")


def _record(path):
    """A stamp: the record of what a rule has left."""
    folder = path.parent / "study"
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    (folder / FOLDER / "screening.json").write_bytes(path.read_bytes())
    list(altered(folder))
    list(changed_inputs(folder))
    recorded(folder, folder / "x.csv")
    made_again(folder, "screening", [path], "abc")


def _batch(path):
    """The mark of a batch of runs."""
    folder = path.parent / "study" / "screening"
    (folder / "batches").mkdir(parents=True, exist_ok=True)
    (folder / "batches" / "0.json").write_bytes(path.read_bytes())
    short_batches(folder, [RUN])


def _consents(path):
    """What the user has allowed."""
    place = path.parent / "granular-calibration" / "allowed.json"
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(path.read_bytes())
    before = os.environ.get("XDG_CONFIG_HOME")
    os.environ["XDG_CONFIG_HOME"] = str(path.parent)
    try:
        remembered("/work")
    finally:
        os.environ.pop("XDG_CONFIG_HOME")
        os.environ.update({"XDG_CONFIG_HOME": before} if before else {})


def _design(path):
    rules = ScreeningConfig(design=str(path))
    screening_design(read_factors(ROOT / "config" / "factors.tsv"), rules)


def repacked(content, seed):
    """A compressed file with one of its parts changed."""
    rng, out = random.Random(seed), io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(out, "w") as target:
        parts = source.namelist()
        # every other time a sheet: most parts say nothing about cells
        sheets = [n for n in parts if "sheet" in n.lower() and n.endswith(".xml")]
        chosen = rng.choice(sheets if sheets and rng.random() < 0.5 else parts)
        for name in parts:
            data = source.read(name)
            target.writestr(name, mutated(data, seed) if name == chosen else data)
    return out.getvalue()


def rechunked(content, seed):
    """A PNG with one of its chunks changed, and the chunk's checksum right again."""
    rng, chunks, at = random.Random(seed), [], 8
    while at < len(content):
        (length,) = struct.unpack_from(">I", content, at)
        chunks.append([content[at + 4 : at + 8], content[at + 8 : at + 8 + length]])
        at += 12 + length
    chosen = rng.choice(chunks)
    if chosen[0] == b"IHDR" and rng.random() < 0.5:
        sides = [rng.choice([0, 1, 3, 120, 5000, 10**6, 2**31 - 1]) for _ in range(2)]
        chosen[1] = struct.pack(">II", *sides) + chosen[1][8:]
    else:
        chosen[1] = mutated(chosen[1], seed)
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    ]
    return content[:8] + b"".join(parts)


def with_other_head(content, seed):
    """A WAV file with a number of its head changed, cut off, or its bytes changed."""
    rng, data = random.Random(seed), bytearray(content)
    if rng.random() < 0.2:
        return bytes(data[: rng.randrange(len(data))])
    if rng.random() < 0.3:
        return mutated(content, seed)
    at, form = rng.choice([(4, "<I"), (16, "<I"), (20, "<H"), (22, "<H"), (24, "<I"), (28, "<I"),
                           (32, "<H"), (34, "<H"), (40, "<I")])  # fmt: skip
    struct.pack_into(form, data, at, rng.choice([0, 1, 2, 3, 7, 8, 24, 32, 64, 44100, 65535]))
    return bytes(data)


def _workbook():
    made = openpyxl.Workbook()
    for row in (["Versuch 1"], ["Nr", "Winkel in °"], [1, 26.1], [2, "27,4"], ["x", "=A3+1"]):
        made.active.append(row)
    made.active.merge_cells("A1:B1")
    out = io.BytesIO()
    made.save(out)
    return out.getvalue()


def _picture():
    y, x = np.mgrid[0:120, 0:160]
    inside = (y < 100) & (100 - y < 0.5 * (60 - np.abs(x - 80)))
    image = np.where(inside[..., None], [90, 60, 40], [205, 210, 220]).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", pnginfo=None, dpi=(72, 72))
    return out.getvalue()


def _sound():
    t = np.arange(8000) / 8000
    at = (0.1, 0.4, 0.6, 0.74)
    sound = sum(np.where(t >= a, np.exp(-(t - a) / 0.003), 0.0) * np.sin(9e3 * t) for a in at)
    out = io.BytesIO()
    wavfile.write(out, 8000, (2e4 * sound / np.abs(sound).max()).astype(np.int16))
    return out.getvalue()


def _table_of_tests():
    """As `dem new --table` writes it, with the grain and a drop filled in by their examples."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.xlsx"
        write_empty(path)
        book = openpyxl.load_workbook(path)
        for row in book.active.iter_rows(min_row=2):
            if row[0].value in ("grain", "drop"):
                q = methods()[row[0].value].question(row[1].value)
                row[2].value = q.example if q else None
            if row[1].value == "rebound":
                row[2].value = "78 mm; 80 mm"
        book.save(path)
        return path.read_bytes()


def _numbers(path):
    for line, row in (table := read_table(path)).rows:
        for column in table.header:
            with suppress(CalibrationError):
                table.number(line, column, row[column])


def _mesh_of(path):
    return read_stl(path, closed=True)


INTERNAL = ("result", "failure", "plan", "record", "batch", "consents")
CHANGES = dict.fromkeys(INTERNAL, resealed) | {"checkpoint": rechecked}
CHANGES |= dict.fromkeys(("configuration", "run spec", "diagnosis settings", "numerics"), restated)
CHANGES |= {
    "workbook": repacked,
    "workbook of tests": repacked,
    "photograph": rechunked,
    "sound": with_other_head,
}
"""Reader: how its files are changed, where it is not by bytes alone."""
ENDS = {"workbook": ".xlsx", "workbook of tests": ".xlsx"}

READERS = {
    "workbook": (_workbook(), _numbers),
    "workbook of tests": (_table_of_tests(), lambda p: read_entries(read_filled(p))),
    "responses": (
        b"run_id,angle_of_repose_deg\nheap-0123456789abcdef,31.5\n",
        lambda p: read_row(p, RUN),
    ),
    "photograph": (_picture(), measure_photo),
    "sound": (_sound(), read_train),
    "curves": (
        b"curve,x [s],y [g]\n"
        + b"".join(b"%d,%d,%d\n" % (c, k, 3 * k + c) for c in range(4) for k in range(9)),
        lambda p: read_curves(p, "mass over time"),
    ),
    "shear tester": (b"normal_stress [kPa],shear_stress [kPa]\n1,0.8\n2,1.5\n4,2.9\n", read_points),
    "index": (
        b'{"run":"heap-0123456789abcdef","engine":"a","wall_time_s":1.0,"files":'
        b'{"result.json":[1,2,3,4]}}\n',
        lambda p: _index(p),
    ),
    "result": (
        _sealed_file(ABOUT, MADE, MANIFEST),
        lambda p: _run_of(p, RESULT),
    ),
    "failure": (
        _sealed_file(MADE, MANIFEST, {"error": "x", "kind": "DemError"}),
        lambda p: _run_of(p, FAILED),
    ),
    "checkpoint": (_checkpoint(), _resume),
    "plan": (json.dumps({RUN: yaml.safe_load(SPEC)}).encode(), _plan),
    "record": (
        _sealed_file({"made_from": "abc", "files": {"x.csv": "0"}, "inputs": {"y": "1"}}),
        _record,
    ),
    "batch": (json.dumps({"runs": [RUN], "failed": []}).encode(), _batch),
    "consents": (json.dumps({"/work": {"engine.command": "x"}}).encode(), _consents),
    "metrics of a program": (b'{"angle_of_repose_deg": 31.5, "height_mm": 12}', read_metrics),
    "sieve": (b"diameter_mm,mass_percent\n1.0,20\n2.0,50\n3.0,30\n", sieve_curve),
    "measurements": ("data/paper/measurements.csv", read_measured),
    "readings": ("examples/soybean/measured.csv", read_measured),
    "factors": ("config/factors.tsv", read_factors),
    "diagnosis settings": ("config/diagnosis.yaml", read_settings),
    "configuration": ("config/config.yaml", _configuration),
    "numerics": ("config/numerics.yaml", lambda p: read_numerics(p, FACTORS)),
    "run spec": (SPEC, load_spec),
    "design table": ("data/paper/table06_plackett_burman.csv", _design),
    "sizes": (
        b"# a sieve\ndiameter_mm,passing_percent\n1.0,0\n2.0,40\n3.0,100\n",
        lambda p: read_sizes(p, "mass"),
    ),
    "clump": (b"x_mm,y_mm,z_mm,radius_mm\n0,0,0,1\n1.0,0.2,0,0.8\n-3e-1,0.9,0.5,0.6\n", read_clump),
    "binary mesh": (_mesh(), _mesh_of),
    "mesh": (ASCII_MESH, _mesh_of),
}
"""Name: (a valid input or the path of one, what reads the path of such a file)."""


LIMIT_S, LIMIT_BYTES = 10, 10**9
"""Processor time of one input, and memory beyond the mapped libraries, in a long trial."""
ROUND = 500
"""Inputs of a reader before the next one has its turn."""


class Late(BaseException):
    """An input took more than LIMIT_S; no reader takes this for an error of its own."""


def _late(number, frame):
    raise Late


def faults(name, seeds, folder, limit_s=0):
    """[(seed, kind, traceback)] of the seeds whose input leads to anything but success or an error
    in a sentence, or takes longer than `limit_s` where that is not 0."""
    source, read = READERS[name]
    content = (ROOT / source).read_bytes() if isinstance(source, str) else source
    path, found = Path(folder) / f"input{ENDS.get(name, '')}", []
    for seed in seeds:
        path.write_bytes(CHANGES.get(name, mutated)(content, seed))
        try:
            signal.setitimer(signal.ITIMER_PROF, limit_s)
            read(path)
        except (CalibrationError, DemError) as error:
            if len(str(error)) > 4000:
                found.append((seed, "long message", str(error)[:400]))
        except (Exception, Late) as error:
            found.append((seed, type(error).__name__, traceback.format_exc()))
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    return found


def main(total, first=0):
    """Try `total` inputs, shared among the readers, and print a traceback of each kind of fault,
    and in the end how many inputs of each reader were tried."""
    resource.setrlimit(resource.RLIMIT_DATA, (LIMIT_BYTES, LIMIT_BYTES))
    signal.signal(signal.SIGPROF, _late)
    count, kinds = total // len(READERS), {name: Counter() for name in READERS}
    with tempfile.TemporaryDirectory() as folder:
        for start in range(first, first + count, ROUND):
            for name in READERS:
                seeds = range(start, min(start + ROUND, first + count))
                for seed, kind, text in faults(name, seeds, folder, LIMIT_S):
                    if not kinds[name][kind]:
                        print(f"--- {name}, seed {seed}\n{text}", flush=True)
                    kinds[name][kind] += 1
            print(f"{(seeds.stop - first) * len(READERS)} inputs", flush=True)
    for name, found in kinds.items():
        print(f"{name}: {count} inputs, {found.total()} faults {dict(found)}")
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{count * len(READERS)} inputs, {most:.0f} MB at most")


if __name__ == "__main__":
    main(int(sys.argv[1]), *map(int, sys.argv[2:3]))
