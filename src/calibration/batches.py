"""Short runs, many to a process: a run of two seconds would otherwise wait as long for Python to start.

Each run is still kept under the content of its spec, so that a batch that was cut off goes on where it stopped.
"""

from pathlib import Path

from calibration.campaign import read_plan
from calibration.discrepancy.runs import simulate
from calibration.errors import CalibrationError
from dem.io.files import write_json


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
