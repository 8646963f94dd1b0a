"""Input that was changed at random leads to success or to one sentence, never to a traceback,
within ten seconds and 1 GB.

A change is drawn from a seeded generator, so that each case can be made again. Files of a structure
are changed within it: a part of a workbook is packed again, a chunk of a picture gets its checksum,
so that the readers behind the library's own checks are reached.
"""

import io
import random
import resource
import signal
import struct
import tempfile
import traceback
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import openpyxl
import pytest
import yaml
from PIL import Image
from refusals import TEXTS, book
from scipy.io import wavfile
from test_refusals import READERS as REFUSING

from calibration.errors import CalibrationError
from calibration.intake.measurements import read_measured
from calibration.intake.photo import measure_photo
from calibration.intake.sound import read_train
from calibration.study.config.as_data import data_of
from calibration.study.config.parse import parse_resolved
from calibration.study.factors import read_factors
from calibration.study.new.answers import read_entries
from calibration.study.new.methods import methods
from calibration.study.new.reading_tables import read_filled, write_empty
from dem.errors import DemError
from dem.io.stl import read_stl, write_stl
from dem.tables import read_table
from diagnosis.settings import study_settings
from facts import ROOT

pytestmark = pytest.mark.slow

TOKENS = [
    b"nan", b"-inf", b"1e999", b"-1", b"0", b"1" * 400, b"", b"\0", b"\xff\xfe", "é²½".encode(),
    b"\t", b",", b";", b'"', b"\n", b"\r\n", b"#", b"=1+1", b"[", b"]", b"{", b"}", b": ", b"- ",
    b"&a ", b"*a", b"!!int ", b"!!python/name:os.system", b"<<: ", b"null", b"2020-01-01", b"1_000",
    b"solid", b"vertex 1 2", b"1,5", b"5 kg", b"%", b"|", b"  ",
]  # fmt: skip
ODD = [None, True, -1, 0, 1e300, float("nan"), 10**30, "", "\0", "../..", "=1+1", "1 mm",
       "x" * 5000, [], [[]], [1, "a"], {}, {"": None}, {"../x": {}}]  # fmt: skip


def mutated(content, rng):
    """`content` (bytes) after one to four random changes."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        end = min(len(data), at + rng.choice([1, 1, 2, 5, 20, 200]))
        change = rng.randrange(5)
        if change == 0:
            del data[at:end]
        elif change == 1:
            data[at:end] = rng.choice(TOKENS)
        elif change == 2:
            data[at:at] = data[at:end] * rng.choice([1, 1, 3])
        elif change == 3 and data:
            data[min(at, len(data) - 1)] = rng.randrange(256)
        elif words := bytes(data).split():
            old, new = rng.choice(words), rng.choice([*TOKENS, rng.choice(words)])
            data[:] = bytes(data).replace(old, new, 1)
    return bytes(data)


def restated(content, rng):
    """A YAML or JSON file with one or two of its values changed."""
    if rng.random() < 0.3:
        return mutated(content, rng)
    data = yaml.safe_load(content)
    places = list(_places(data))
    for holder, key in rng.sample(places, min(len(places), rng.randint(1, 2))):
        with suppress(KeyError, IndexError, TypeError):
            holder[key] = rng.choice(ODD)
    return yaml.safe_dump(data).encode(errors="replace")


def _places(data):
    """(holder, key) of each value inside a mapping or a list, at whatever depth."""
    for key in list(data) if isinstance(data, dict) else range(len(data)):
        yield data, key
        if isinstance(data[key], dict | list):
            yield from _places(data[key])


def repacked(content, rng):
    """A compressed file with one of its parts changed."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(out, "w") as target:
        parts = source.namelist()
        sheets = [n for n in parts if "sheet" in n.lower() and n.endswith(".xml")]
        chosen = rng.choice(sheets if rng.random() < 0.5 else parts)
        for name in parts:
            data = source.read(name)
            target.writestr(name, mutated(data, rng) if name == chosen else data)
    return out.getvalue()


def rechunked(content, rng):
    """A PNG with one of its chunks changed, and the chunk's checksum right again."""
    chunks, at = [], 8
    while at < len(content):
        (length,) = struct.unpack_from(">I", content, at)
        chunks.append([content[at + 4 : at + 8], content[at + 8 : at + 8 + length]])
        at += 12 + length
    chosen = rng.choice(chunks)
    if chosen[0] == b"IHDR":
        sides = [rng.choice([0, 1, 3, 120, 5000, 10**6, 2**31 - 1]) for _ in range(2)]
        chosen[1] = struct.pack(">II", *sides) + chosen[1][8:]
    else:
        chosen[1] = mutated(chosen[1], rng)
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    ]
    return content[:8] + b"".join(parts)


def with_other_head(content, rng):
    """A WAV file with a number of its head changed, or its bytes."""
    if rng.random() < 0.3:
        return mutated(content, rng)
    data = bytearray(content)
    at, form = rng.choice([(4, "<I"), (16, "<I"), (20, "<H"), (22, "<H"), (24, "<I"), (28, "<I"),
                           (32, "<H"), (34, "<H"), (40, "<I")])  # fmt: skip
    struct.pack_into(form, data, at, rng.choice([0, 1, 2, 3, 7, 8, 24, 32, 64, 44100, 65535]))
    return bytes(data)


def written(write, end=""):
    """Bytes of what a function writes into a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{end}"
        write(path)
        return path.read_bytes()


HEAPS = [["Versuch 1"], ["Nr", "Winkel in °"], [1, 26.1], [2, "27,4"], ["x", "=A3+1"]]


def _table_of_tests(path):
    """As `dem new --table` writes it, with the grain and a drop filled in by their examples."""
    write_empty(path)
    book = openpyxl.load_workbook(path)
    for row in book.active.iter_rows(min_row=2):
        if row[0].value in ("grain", "drop"):
            q = methods()[row[0].value].question(row[1].value)
            row[2].value = q.example if q else None
        if row[1].value == "rebound":
            row[2].value = "78 mm; 80 mm"
    book.save(path)


def _picture(path):
    y, x = np.mgrid[0:120, 0:160]
    inside = (y < 100) & (100 - y < 0.5 * (60 - np.abs(x - 80)))
    image = np.where(inside[..., None], [90, 60, 40], [205, 210, 220]).astype(np.uint8)
    Image.fromarray(image).save(path, "PNG", dpi=(72, 72))


def _sound(path):
    t = np.arange(8000) / 8000
    at = (0.1, 0.4, 0.6, 0.74)
    sound = sum(np.where(t >= a, np.exp(-(t - a) / 0.003), 0.0) * np.sin(9e3 * t) for a in at)
    wavfile.write(path, 8000, (2e4 * sound / np.abs(sound).max()).astype(np.int16))


def _mesh(path):
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    write_stl(path, corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]))


def _numbers(path):
    for line, row in (table := read_table(path)).rows:
        for column in table.header:
            with suppress(DemError):
                table.number(line, column, row[column])


def _configuration(path):
    with path.open(encoding="utf-8") as stream:  # as snakemake opens it
        study_settings(parse_resolved(data_of(stream), [path]))


YAML = ("run spec", "numerics", "metrics")
OWN = ("configuration", "factors", "measured table", "design", "workbook", "photograph", "sound")
"""Kinds of `test_refusals.py` that have richer files below."""
READERS = {
    kind: (TEXTS[kind].encode(), read, restated if kind in YAML else mutated)
    for kind, (_, read) in REFUSING.items()
    if kind not in OWN
} | {
    "workbook": (written(book(HEAPS, merge=["A1:B1"]), ".xlsx"), _numbers, repacked),
    "workbook of tests": (
        written(_table_of_tests, ".xlsx"), lambda p: read_entries(*read_filled(p)), repacked),
    "photograph": (written(_picture), measure_photo, rechunked),
    "sound": (written(_sound), read_train, with_other_head),
    "binary mesh": (written(_mesh), lambda p: read_stl(p, closed=True), mutated),
    "measurements": ("data/paper/measurements.csv", read_measured, mutated),
    "readings": ("examples/soybean/measured.csv", read_measured, mutated),
    "factors": ("config/factors.tsv", read_factors, mutated),
    "configuration": ("config/config.yaml", _configuration, restated),
}  # fmt: skip
"""Name: (a valid input or the path of one, what reads the path of such a file, how it changes)."""

LIMIT_S, LIMIT_BYTES = 10, 10**9
"""Processor time of one input, and memory beyond what is there."""


class Late(BaseException):
    """An input took more than LIMIT_S; no reader takes this for an error of its own."""


def _late(number, frame):
    raise Late


@pytest.fixture
def limits():
    """Limits of time and memory while a test runs."""
    before, kept = resource.getrlimit(resource.RLIMIT_DATA), signal.signal(signal.SIGPROF, _late)
    held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_DATA, (held + LIMIT_BYTES, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_DATA, before)
    signal.signal(signal.SIGPROF, kept)


# numpy leaves a damaged archive open until it is collected
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", READERS)
def test_changed_input_is_read_or_refused_in_a_sentence(name, tmp_path, limits):
    source, read, change = READERS[name]
    content = (ROOT / source).read_bytes() if isinstance(source, str) else source
    path, found = tmp_path / f"input{'.xlsx' if 'workbook' in name else ''}", []
    for seed in range(60):
        path.write_bytes(change(content, random.Random(seed)))
        try:
            signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
            read(path)
        except (CalibrationError, DemError) as error:
            found += [f"{seed}: {error}"] * (len(str(error)) > 4000)
        except (Exception, Late):
            found.append(f"{seed}: {traceback.format_exc()}")
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    assert not found, "\n".join(found[:3])
