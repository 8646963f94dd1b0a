"""Any program as the engine: it is given a run spec and leaves metrics.

The program is started in the run's folder with `spec.yaml` there and `{spec}`, `{out}` and `{seed}`
in the command filled in. It leaves `metrics.json`, a flat mapping of names to numbers, and ends
with status 0.
"""

import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import Field, StrictFloat, StrictInt, TypeAdapter, ValidationError, field_validator

from calibration.engines import Engine, EngineError, Settings
from calibration.engines.program import run
from calibration.intake.started_code import refusal
from dem.errors import InputError
from dem.spec import RunSpec
from dem.tables.limits import read_limited


class CommandSettings(Settings):
    """A program and what its numbers depend on."""

    command: str = Field(
        min_length=1, description="command line; {spec}, {out}, {seed} are filled in"
    )
    version: str = Field(
        description="version of the program, yours to raise: other versions are other runs"
    )
    files: list[str] = Field([], description="scripts and tables whose content names the runs too")

    @field_validator("command")
    @classmethod
    def _can_be_filled_in(cls, text):
        try:
            filled_in(text, "", "", 0)
        except (ValueError, LookupError, AttributeError) as error:
            raise ValueError(
                f"cannot be filled in ({error}); allowed: {{spec}}, {{out}}, {{seed}}, and double "
                "braces for its own"
            ) from None
        return text


def filled_in(command: str, spec: str | Path, out: str | Path, seed: int) -> list[str]:
    """Words of a command line. Raises ValueError, LookupError or AttributeError for one that is
    none."""
    return [word.format(spec=spec, out=out, seed=seed) for word in shlex.split(command)]


METRICS: Any = TypeAdapter(
    Annotated[
        dict[str, StrictInt | Annotated[StrictFloat, Field(allow_inf_nan=False)]],
        Field(min_length=1),
    ]
)
"""What a program leaves: at least one number, none of them infinite."""


def identity(settings: Any) -> dict[str, Any]:
    """Version and the content of the files that the numbers depend on. Raises EngineError for a
    missing file."""
    try:
        contents = [hashlib.sha256(Path(f).read_bytes()).hexdigest() for f in settings.files]
    except OSError as error:
        raise EngineError(f"engine.files: {error.filename}: {error.strerror}") from None
    return {"version": settings.version, "files": contents}


def simulate(
    spec: RunSpec, folder: Path, entry: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Run the command in `folder`; returns (metrics, {}). Raises EngineError, also for a command
    that nobody has allowed."""
    settings = entry["settings"]
    if unasked := refusal("engine.command", settings["command"]):
        raise EngineError(unasked)
    (folder / "spec.yaml").write_text(yaml.safe_dump(spec.model_dump(mode="json")))
    (folder / "metrics.json").unlink(missing_ok=True)
    words = filled_in(settings["command"], folder / "spec.yaml", folder, spec.seed)
    # files are named as the study names them, so the command starts where the study does
    run([_here(word) for word in words], folder, settings["timeout_s"])
    return read_metrics(folder / "metrics.json"), {}


def _here(word):
    # a link is kept: by the name of its link an interpreter finds its environment's packages
    return str(Path(word).absolute()) if Path(word).is_file() else word


def read_metrics(path: str | Path) -> dict[str, float]:
    """{name: finite number} of a metrics file. Raises EngineError."""
    try:
        return METRICS.validate_json(read_limited(path, "table"))
    except InputError as error:
        said = error.reason
    except ValidationError as error:
        first = error.errors()[0]
        said = " ".join([*map(str, first["loc"][:1]), f"{first['input']!r:.80}:", first["msg"]])
    raise EngineError(
        f"the program left no usable {Path(path).name}, names of metrics to numbers: {said:.200}"
    )


ENGINE = Engine("command", CommandSettings, (), identity, simulate)
