"""Many short runs in one process, each under the name of its content and skipped where its result is there."""

import json
from pathlib import Path

from calibration.campaign import run_id
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.run import run
from dem.spec import parse_spec


def simulate(specs, root="results/runs", note=lambda text: None):
    """{run id: metrics or None} of {run id: spec}; None where the engine reports a failure (recorded as
    failed.json)."""
    return {name: _result(name, spec, Path(root), note) for name, spec in specs.items()}


def named(specs):
    """{run id: spec} of a list of specs."""
    return {run_id(s): s for s in specs}


def _result(name, spec, root, note):
    folder = root / name
    known = _read(folder / "result.json") or _read(folder / "failed.json")
    if known and known["engine"] == engine_fingerprint():
        return known["metrics"]
    try:
        metrics = run(parse_spec(spec), folder)["metrics"]
    except (DemError, RuntimeError) as error:
        note(f"{name} failed: {error}")
        failure = {"engine": engine_fingerprint(), "metrics": None, "error": str(error)}
        (folder / "failed.json").write_text(json.dumps(failure))
        return None
    note(f"{name} done")
    return metrics


def _read(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
