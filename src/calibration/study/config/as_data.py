"""Configurations are data: what snakemake would evaluate in one is refused before it does.

snakemake hands a configuration to YTE, which runs the Python in it where the file asks for that.
The profiles of this project call `read_as_data` first. From then on the process reads YAML and runs
nothing in it.
"""

import sys
from pathlib import Path
from typing import Any, TextIO

from calibration.errors import ConfigError
from dem.errors import SpecError
from dem.io.mapping import parse_mapping
from dem.tables.limits import KINDS

OWN = {
    "__use_yte__": True,
    "__definitions__": [
        "from calibration.study.config.as_data import read_as_data",
        "read_as_data()",
    ],
}
"""What the project's profiles ask for; snakemake may read a second one of them after the first."""

MOST = KINDS["configuration"].most
EVALUATED = ("__use_yte__", "__definitions__", "__variables__")


def read_as_data() -> None:
    """Let snakemake read configurations as data from now on."""
    import yte

    yte.process_yaml = _as_data


def _as_data(source, *_, **__):
    try:
        return data_of(source)
    except ConfigError as error:
        sys.exit(f"{error}")  # snakemake would show a traceback for it


def data_of(source: str | TextIO) -> Any:
    """Mapping of a YAML stream or text. Raises ConfigError for one that asks to be evaluated, or
    that is not YAML."""
    name = getattr(source, "name", "configuration")
    try:
        text = source if isinstance(source, str) else source.read(MOST + 1)
        if len(text) > MOST:
            raise ConfigError("is too large for a configuration", path=Path(name),
                              allowed=f"at most {MOST:,} characters")  # fmt: skip
        data, lines = parse_mapping(text, name)
    except SpecError as error:
        raise ConfigError(str(error)) from None
    except UnicodeDecodeError:
        raise ConfigError("is not text", path=Path(name), allowed="UTF-8") from None
    if isinstance(data, dict) and {k: data.get(k) for k in OWN} == OWN:
        data = {k: v for k, v in data.items() if k not in OWN}
    if isinstance(data, dict | list):
        _refuse_code(data, lines, name)
    return data


def _refuse_code(data, lines, path, prefix=""):
    """Raise ConfigError for the first key or value that YTE would run."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        place = f"{prefix}{key}"
        asks = [x for x in (key, value) if isinstance(x, str) and x.startswith("?")]
        if key in EVALUATED or asks:
            raise ConfigError(
                "asks to be run as code", path=Path(path), line=lines.get(place), key=place,
                value=asks[0] if asks else value,
                allowed="data alone; a configuration is never evaluated",
            )  # fmt: skip
        if isinstance(value, dict | list):
            _refuse_code(value, lines, path, f"{place}.")
