"""A run's result as it is kept: with a manifest of all that it depends on, checked at each read.

`result.json` is written last, atomically: its existence means success. Its manifest says which run
it is, what was computed with, and the checksums of the files beside it; a checksum of the whole
stands at its end.
"""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dem.errors import ResultError
from dem.fingerprint import cpu_target, engine_fingerprint, software
from dem.io.files import digest_of, is_sealed, sealed, write_json
from dem.spec import RunSpec, content_hash, input_digests

RESULT, FAILED, STATE = "result.json", "failed.json", "final.npz"
RUN_NAME = re.compile(r"[a-z_]+-[0-9a-f]{16}")

OTHER = "other: "
CHANGED = "has changed since it was written: its checksum does not fit"

MANIFEST = {"run": str, "inputs": dict, "software": dict, "files": dict}
SHAPES = {
    RESULT: {"experiment": str, "seed": int, "spec": dict, "engine": str}
    | {"metrics": dict, "numerics": dict, "manifest": dict},
    FAILED: {"engine": str, "error": str, "kind": str, "manifest": dict},
}
"""File -> kind of value of each key that it must hold, at least."""


def engine_of(spec: RunSpec) -> str:
    """Return what makes a `RunSpec`'s run: this engine's fingerprint, or the name of another
    engine."""
    return engine_fingerprint() if spec.engine is None else OTHER + spec.engine.name


def is_current(engine: str) -> bool:
    """Return whether what `engine_of` named still stands: this engine as it is now, or another one,
    whose version is part of the run's name."""
    return engine == engine_fingerprint() or engine.startswith(OTHER)


def run_name(spec: RunSpec) -> str:
    """Name of a run: experiment and content hash of its `RunSpec`."""
    return f"{spec.experiment}-{content_hash(spec)}"


def write_result(
    folder: str | Path,
    spec: RunSpec,
    metrics: Mapping[str, Any],
    numerics: Mapping[str, Any],
    files: Sequence[str] = (STATE,),
) -> dict[str, Any]:
    """Write result.json for a `RunSpec`, sealed; `files` of the folder become part of it. Returns
    its content."""
    folder = Path(folder)
    result = {
        "experiment": spec.experiment,
        "seed": spec.seed,
        "spec": spec.model_dump(mode="json"),
        "engine": engine_of(spec),
        "metrics": metrics,
        "numerics": numerics,
        "manifest": _manifest(spec) | {"files": {n: digest_of(folder / n) for n in files}},
    }
    result = sealed(result)
    write_json(folder / RESULT, result)
    return result


def write_failure(folder: str | Path, spec: RunSpec, error: BaseException) -> None:
    """Write failed.json: a physical failure, which the same spec would meet again."""
    failure = {
        "engine": engine_of(spec),
        "metrics": None,
        "error": str(error),
        "kind": type(error).__name__,
        "manifest": _manifest(spec) | {"files": {}},
    }
    write_json(Path(folder) / FAILED, sealed(failure))


def _manifest(spec):
    return {
        "run": run_name(spec),
        "inputs": input_digests(spec),
        "software": software() | {"cpu": cpu_target()},
    }


def read_result(folder: str | Path, files: bool = True, name: str = RESULT) -> dict[str, Any]:
    """Content of a folder's result.json, or of failed.json. Raises ResultError where it is missing,
    damaged or of another run; `files`: check those that belong to it as well."""
    folder = Path(folder)
    path = folder / name
    try:
        result = json.loads(_or_refused(path, Path.read_bytes, missing=True).decode())
    except (ValueError, RecursionError):
        raise ResultError(path, "is damaged: it cannot be read as JSON") from None
    if not isinstance(result, dict) or "manifest" not in result:
        raise ResultError(path, "has no manifest: it was written by an old version or by hand")
    if not is_sealed(result):
        raise ResultError(path, CHANGED)
    _check_shape(path, result, SHAPES[name])
    _check_shape(path, result["manifest"], MANIFEST, "manifest.")
    for key, value in (result["metrics"] or {}).items():
        if value is not None and type(value) not in (int, float):
            raise ResultError(path, f"is not as a run is written: metrics.{key} is {value!r:.80}")
    for file, digest in result["manifest"]["files"].items():  # named without a folder
        if Path(file).name != file or not isinstance(digest, str):
            said = f"manifest.files.{file:.80} is {digest!r:.80}"
            raise ResultError(path, f"is not as a run is written: {said}")
    run = result["manifest"]["run"]
    if RUN_NAME.fullmatch(folder.name) and folder.name != run:
        raise ResultError(path, f"is the result of another run, {run}")
    for file, digest in result["manifest"]["files"].items() if files else ():
        if _or_refused(folder / file, digest_of) != digest:
            raise ResultError(folder / file, CHANGED)
    return result


def _check_shape(path, found, wanted, within=""):
    for key, kind in wanted.items():
        value = found.get(key)
        if not isinstance(value, kind) or isinstance(value, bool):
            said = f"{within}{key} is {value!r:.80}, not of the kind {kind.__name__}"
            raise ResultError(path, f"is not as a run is written: {said}")


def _or_refused(path, read, missing=False):
    """Return what read(path) gives. Raises ResultError where the file cannot be read; `missing`:
    whether there is no result then."""
    try:
        return read(path)
    except FileNotFoundError:
        raise ResultError(path, "is missing", missing) from None
    except OSError as error:
        raise ResultError(path, f"cannot be read ({error.strerror})") from None
