"""A made-up study, and answers by formulas to the runs that it plans."""

import zlib
from pathlib import Path

import numpy as np
import yaml

from calibration.runs.plans import read_plan
from calibration.runs.store import RunStore
from calibration.study.config import parse_config
from calibration.study.factors import Factor
from dem.results import write_result
from dem.spec import parse_spec
from small_heap import RUN

HEAP = {"particles": {"count": 100, "diameter_mm": 2.0},
        "geometry": {"generation_rate_per_s": 1000}}  # fmt: skip


READINGS = """experiment,quantity,value,unit
heap,angle_of_repose,3,deg
heap,angle_of_repose,4,deg
"""


def factors(k):
    """k factors A, B, ... between 0 and 1."""
    return [Factor(chr(65 + i), f"f{i}", f"k{i}", 0.0, 1.0) for i in range(k)]


def made_up(folder, monkeypatch, keys, measured=READINGS, ends=(0.1, 0.5), **more):
    """Configuration of a study in a folder, from now on the working directory, with the factors
    {name: key} between `ends`, or {name: (key, low, high)}, and the text of its measured table."""
    monkeypatch.chdir(folder)
    rows = ["code\tname\tkey\tlow\thigh"]
    for code, (name, key) in zip("ABCDE", keys.items(), strict=False):
        own = key if isinstance(key, tuple) else (key, *ends)
        rows.append("\t".join(map(str, (code, name, *own))))
    Path("factors.tsv").write_text("\n".join(rows) + "\n")
    Path("measured.csv").write_text(measured)
    data = {
        "name": "made-up", "factors": "factors.tsv", "measurements": "measured.csv",
        "run": {"materials": RUN["materials"], "contacts": RUN["contacts"]},
        "tests": {"heap": {"experiment": "heap", "run": HEAP}},
    }  # fmt: skip
    data |= more
    Path("config.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
    return parse_config(data, files=["config.yaml"])


def answer(plan, formula, **numerics):
    """Write the result of every planned run: formula(spec, rng) -> metrics."""
    for name, spec in read_plan(plan).items():
        metrics = formula(spec, np.random.default_rng(zlib.crc32(name.encode())))
        folder = RunStore().folder(name)
        write_result(folder, parse_spec(spec), metrics, numerics, files=())
