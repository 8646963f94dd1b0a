"""A run gives the same result on every machine: no BLAS in the engine, and two processors that
agree to the bit."""

import ast
import json
import os
import platform

import pytest
import small_rigs
from test_enlarged import TYPE_A, spec_of

from dem.fingerprint import ROOT, engine_sources
from started import python

# what numpy and scipy hand to BLAS or LAPACK, whose kernels round by the processor
BANNED = {
    "convolve", "corrcoef", "correlate", "cov", "dot", "einsum", "inner", "linalg", "lstsq",
    "matmul",
    "polyfit", "polynomial", "tensordot", "vdot",
}  # fmt: skip

CANNOT_ACT = {
    "contact/damping/thornton.py": "what scipy solves for is rounded to seven decimals; BLAS "
    "differs in the 15th"
}


def calls_of_blas(source):
    """Line numbers and names of what may reach BLAS or LAPACK in a Python source."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield node.lineno, "@"
        elif isinstance(node, ast.Attribute) and (node.attr == "dot" or _of_numpy(node)):
            yield node.lineno, node.attr
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, a.name) for a in node.names if _foreign(a.name))
        elif isinstance(node, ast.ImportFrom) and _foreign(node.module or ""):
            yield node.lineno, node.module


def _of_numpy(node):
    return (
        node.attr in BANNED
        and isinstance(node.value, ast.Name)
        and node.value.id in ("np", "numpy")
    )


def _foreign(module):
    return module.split(".")[0] == "scipy" or module in ("numpy.linalg", "numpy.polynomial")


def test_nothing_in_the_engine_calls_blas():
    found = [
        f"{path}:{line}: {name}"
        for path in engine_sources()
        if path.relative_to(ROOT).as_posix() not in CANNOT_ACT
        for line, name in calls_of_blas(path.read_text(encoding="utf-8"))
    ]
    assert not found, "\n".join(found)


RUNS = {
    name: spec_of(name, TYPE_A, "mixed").model_dump(mode="json", exclude_none=True)
    for name in ("drop", "tilt", "heap", "shear")
} | {
    "elongated grains": {
        "experiment": "heap",
        "particles": {"count": 150, "diameter_mm": 4.0, "elongation": 1.5},
        "geometry": {"orifice_diameter_mm": 30.0},  # nothing clogs
        "contacts": small_rigs.ROUGH,
    },
}
"""Runs that take seconds."""
RUN_ALL = """
import hashlib, json, sys, tempfile
import numpy as np
from dem.run import run
from dem.spec import parse_spec

out = {}
for name, spec in json.load(sys.stdin).items():
    for precision in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            spec["numerics"] = {"precision": precision}
            metrics = run(parse_spec(spec), folder)["metrics"]
            with np.load(folder + "/final.npz") as last:
                state = b"".join(last[k].tobytes() for k in sorted(last.files))
        out[f"{name}, {precision}"] = [hashlib.sha256(state).hexdigest(), metrics]
print(json.dumps(out))
"""
PRECISIONS = "mixed", "double"
FUSED = "x86-64-v3"
"""AVX2 and fused multiply-add: Intel since 2013, AMD since 2015."""
NEWER = (
    "AVX512F",
    "AVX512CD",
    "AVX512_SKX",
    "AVX512_CLX",
    "AVX512_CNL",
    "AVX512_ICL",
    "AVX512_SPR",
)


def cpu_features():
    """Features that numpy finds on this machine."""
    from numpy._core._multiarray_umath import __cpu_features__

    return {name for name, found in __cpu_features__.items() if found}


def target(name):
    """What makes numba compile for a processor: a name alone would leave it this machine's
    features."""
    return {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""}


def run_all(runs, precisions, **environment):
    """{run: [digest of the last state, metrics]} of runs in a process of its own."""
    more = {"input": json.dumps(runs), "env": os.environ | environment}
    return json.loads(python(None, "-c", RUN_ALL, *precisions, **more).stdout)


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of x86 processors")
def test_processors_with_fused_multiplication_agree_to_the_bit(tmp_path):
    """This machine against one of 2013: numba's target, numpy's loops and OpenBLAS' kernels are
    those of the older."""
    features = cpu_features()
    if not {"AVX2", "FMA3"} <= features:
        pytest.skip("this machine has no fused multiplication")
    here = run_all(RUNS, PRECISIONS)
    there = run_all(
        RUNS,
        PRECISIONS,
        **target(FUSED),
        NUMBA_CACHE_DIR=str(tmp_path),
        OPENBLAS_CORETYPE="Haswell",
        NPY_DISABLE_CPU_FEATURES=" ".join(name for name in NEWER if name in features),
    )
    assert set(here) == set(there)
    different = [name for name in here if here[name][0] != there[name][0]]
    assert not different, f"other last states on an older processor: {different}"
    for name, (_, metrics) in here.items():
        # what is measured from a state may round its sines and cosines in another way
        assert there[name][1] == pytest.approx(metrics, rel=1e-9), name
