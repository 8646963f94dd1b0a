"""Short runs, many to a process: a run of two seconds would otherwise wait as long for Python to
start.

Each run is still kept under the content of its spec and skipped where its result is there, so that
a batch that was cut off goes on where it stopped.
"""

from calibration import engines
from calibration.campaign import read_plan, run_id
from calibration.errors import CalibrationError
from calibration.store import ROOT, RunStore
from dem.errors import PHYSICAL, StoppedError
from dem.io.files import write_json
from dem.results import write_failure
from dem.spec import parse_spec


def run_batch(plan_file, batch, batches, done, failures="refused", root=ROOT):
    """Do every `batches`-th run of a plan, from number `batch` on, and write their names to `done`.

    failures: "refused" raises CalibrationError naming the runs that failed and why, after the
    others have been done; "kept" lists them in `done`, for who can do without them. What the
    machine did to a run is refused in either case."""
    specs = read_plan(plan_file)
    names = sorted(specs)[batch::batches]
    found = simulate({n: specs[n] for n in names}, root, note=lambda text: print(text, flush=True))
    failed = [name for name, metrics in found.items() if metrics is None]
    if failed and failures == "refused":
        store = RunStore(root)
        lines = [f"{n}: {(store.failure(n) or {}).get('error', '')}" for n in failed]
        raise CalibrationError(f"{len(failed)} runs of {plan_file} failed\n" + "\n".join(lines))
    write_json(done, {"runs": names, "failed": failed})


def simulate(specs, root=ROOT, note=lambda text: None):
    """{run id: metrics or None} of {run id: spec}; None where the run fails physically, which is
    kept as failed.json.

    Any other failure, such as a full disk, is no property of the run and is not kept:
    CalibrationError names these runs after the others have been done.
    """
    store, found, faults = RunStore(root), {}, []
    for name, spec in specs.items():
        try:
            found[name] = _metrics(store, name, spec, note)
        except StoppedError:
            raise
        except Exception as error:
            faults.append(f"{name}: {type(error).__name__}: {error}")
            note(f"{faults[-1]} (not kept: the run is made again)")
    if faults:
        raise CalibrationError(f"{len(faults)} runs could not be made\n" + "\n".join(faults))
    return found


def named(specs):
    """{run id: spec} of a list of specs."""
    return {run_id(s): s for s in specs}


def _metrics(store, name, spec, note):
    known = store.current(name) or store.failure(name)
    if known:
        return known["metrics"]
    parsed, folder = parse_spec(spec), store.folder(name)
    try:
        metrics = engines.make(spec, folder, again=False)["metrics"]
    except PHYSICAL as error:
        note(f"{name} failed: {error}")
        write_failure(folder, parsed, error)
        return None
    store.entry(name)
    note(f"{name} done")
    return metrics
