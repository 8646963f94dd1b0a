"""Runs made where they are asked for, in this process, and kept under the content of their specs.

A module of its own: who only needs runs does not depend on how batches share and report them.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from calibration import engines
from calibration.errors import CalibrationError
from calibration.runs.plans import run_id
from calibration.runs.store import RunStore
from dem.errors import PHYSICAL, BlowUpError, RefusedStateError, StoppedError
from dem.results import write_failure
from dem.spec import parse_spec


def simulate(
    specs: Mapping[str, dict[str, Any]], root: str | Path | None = None
) -> dict[str, dict[str, float] | None]:
    """{run id: metrics or None} of {run id: spec}; None where the run fails physically, which is
    kept as failed.json.

    Any other failure, such as a full disk, is no property of the run and is not kept:
    CalibrationError names these runs after the others have been done.
    """
    store, found, faults = RunStore(root), {}, []
    for name, spec in specs.items():
        try:
            found[name] = _metrics(store, name, spec)
        except StoppedError:
            raise
        except Exception as error:
            faults.append(f"{name}: {type(error).__name__}: {error}")
    if faults:
        raise CalibrationError(f"{len(faults)} runs could not be made\n" + "\n".join(faults))
    return found


RESTLESS = ("are not at rest", "was never opened")
"""What the engine says of grains that never came to rest."""


def untested(names: Iterable[str]) -> set[str]:
    """The set of those runs that are no test which ended without a value, as the kept failures say:
    the simulation became unphysical, for its step or its stiffness, or was cut off before its
    grains rested."""
    store = RunStore()
    return {name for name in names if _no_test(store.failure(name) or {})}


def _no_test(failure):
    """Return whether a failure says nothing of the grains."""
    if failure.get("kind") == BlowUpError.__name__:
        return True
    said = failure.get("error", "")
    return failure.get("kind") == RefusedStateError.__name__ and any(w in said for w in RESTLESS)


def named(specs: Iterable[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """{run id: spec} of a list of specs."""
    return {run_id(s): s for s in specs}


def _metrics(store, name, spec):
    known = store.current(name) or store.failure(name)
    if known:
        return known["metrics"] or None  # a stage keeps a run without a value as a result
    parsed, folder = parse_spec(spec), store.folder(name)
    try:
        metrics = engines.make(spec, folder, again=False)["metrics"]
    except PHYSICAL as error:
        write_failure(folder, parsed, error)
        return None
    store.entry(name)
    return metrics
