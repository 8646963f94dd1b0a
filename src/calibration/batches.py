"""Short runs, many to a process: a run of two seconds would otherwise wait as long for Python to start.

Each run is still kept under the content of its spec and skipped where its result is there, so that a batch that was
cut off goes on where it stopped.
"""

import json
from pathlib import Path

from calibration.campaign import read_plan, run_id
from calibration.errors import CalibrationError
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.run import run
from dem.spec import parse_spec


def run_batch(plan_file, batch, batches, done, failures="refused", root="results/runs"):
    """Do every `batches`-th run of a plan, from number `batch` on, and write their names to `done`.

    failures: "refused" raises CalibrationError naming the runs that failed and why, after the others have been done;
    "kept" lists them in `done`, for who can do without them.
    """
    specs = read_plan(plan_file)
    names = sorted(specs)[batch::batches]
    found = simulate({n: specs[n] for n in names}, root, note=lambda text: print(text, flush=True))
    failed = [name for name, metrics in found.items() if metrics is None]
    if failed and failures == "refused":
        reasons = (read_plan(Path(root) / n / "failed.json").get("error", "") for n in failed)
        lines = [f"{n}: {reason}" for n, reason in zip(failed, reasons, strict=True)]
        raise CalibrationError(f"{len(failed)} runs of {plan_file} failed\n" + "\n".join(lines))
    write_json(done, {"runs": names, "failed": failed})


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
        write_json(folder / "failed.json", failure)
        return None
    note(f"{name} done")
    return metrics


def _read(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
