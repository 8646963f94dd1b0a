"""What may start code that is not this project's own: one list, and the consent that a setting in a
file needs.

`STARTS` is the list; the site shows it, and a test holds it against every place in the sources that
starts a program or loads Python. A setting of a configuration that
starts code (`SETTINGS`) is refused until the user consents. There are two ways: the same value on
the command line, or `calibration allow STUDY`, which is remembered for the folder that the study is
run in. The consent is kept in the user's own folder, so no study can bring its own.
"""

import json
import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibration.errors import ConfigError
from calibration.files import read_json, write_text

BY_CONSENT = "`calibration allow STUDY` once, or the same value behind `--config`"
BY_PERSON = "whoever starts the command there, or sets it in the environment"


@dataclass(frozen=True)
class Start:
    """One thing that may start code."""

    name: str
    """Key of a configuration, variable of the environment, or file."""
    runs: str
    """What is run."""
    allowed_by: str
    """Who allows it."""
    places: tuple[str, ...]
    """Sources, below src, that start it."""


STARTS = (
    Start(
        "engine.command",
        "the command line, in the folder of each run",
        BY_CONSENT,
        ("calibration/engines/program.py",),
    ),
    Start(
        "diagnosis.catalogue",
        "the Python files of the folder, in the stage `diagnose`",
        BY_CONSENT,
        ("diagnosis/catalogue/__init__.py",),
    ),
    Start(
        "DEM_EXPERIMENTS",
        "the Python files of the folders, whenever `dem` or the workflow starts",
        BY_PERSON,
        ("dem/experiments/__init__.py",),
    ),
    Start(
        "Snakefile",
        "the workflow of the folder where `snakemake` or `calibration run` starts (without a "
        "Snakefile there the package's), and Python files there that have the name of a package "
        "(`yaml.py`)",
        BY_PERSON,
        ("calibration/runs/snakemake_command.py",),
    ),
    Start(
        "profiles",
        "Python in `profiles/default/config.yaml` and `workflow/profiles/default/config.yaml` of "
        "that folder, and in a profile that the command names",
        BY_PERSON,
        ("calibration/runs/snakemake_command.py",),
    ),
    Start(
        "engine: liggghts, lammps, yade",
        "the program of that name beside this Python or on the PATH, on a deck that this project "
        "writes",
        "whoever installs the program",
        ("calibration/engines/program.py",),
    ),
    Start(
        "NUMBA_CACHE_DIR",
        "machine code and pickles that numba has kept there; unless set, in a folder that the user "
        "alone can write",
        BY_PERSON,
        ("dem/kernel_cache.py",),
    ),
)

OWN = {
    "dem/contact/dispatch.py": "a function that the laws' own declarations are written out to",
    "dem/lazy.py": "a module of an installed package, when it is first used",
    "workflow/scripts/reference.py": "snakemake, for each study of the paper's reference",
    "paper/release/command.py": "the release's own commands",
}
"""Sources that start code of this project alone, and which; below src, or of the workflow."""

SETTINGS = tuple(start.name for start in STARTS if start.allowed_by == BY_CONSENT)

_permitted: set[tuple[str, str]] = set()


def settings_of(config: Any) -> dict[str, str]:
    """{key: value} of what in a `Config` starts code."""
    engine = config.engine if isinstance(config.engine, Mapping) else {}
    command = engine.get("command") if engine.get("name") == "command" else None
    found = dict(zip(SETTINGS, (command, config.diagnosis.get("catalogue")), strict=True))
    return {key: str(value) for key, value in found.items() if value is not None}


def refuse_unasked(
    config: Any, asked: Mapping[str, Any] | None, files: Iterable[str | Path] = ()
) -> None:
    """Raise ConfigError for the first setting of a `Config` that starts code and that the user has
    not consented to.

    asked: the mapping that `--config` gave on the command line; files: those of the configuration.
    """
    given = remembered(Path.cwd())
    for key, value in settings_of(config).items():
        if _at(asked or {}, key) == value or given.get(key) == value:
            continue
        study = shlex.join(os.path.relpath(f) for f in files) or "STUDY"
        raise ConfigError(
            "would start code; a configuration file may not do so by itself",
            key=key,
            value=value,
            allowed=f"once `calibration allow {study}` in this folder, if you know what it starts; "
            f"or on the command line: {_flag(key, value)}",
        )


def permit(config: Any) -> None:
    """Let this process start what a `Config` names: for a job, whose caller has been asked."""
    _permitted.update(settings_of(config).items())


def refusal(key: str, value: str) -> str | None:
    """Why this process may not start what `key` names, in a sentence; None where it may. A run's
    spec comes from a file too, and says what is started."""
    if (key, value) in _permitted or remembered(Path.cwd()).get(key) == value:
        return None
    return (
        f"{key} = {value!r:.200} would start code that the study's configuration does not name, or "
        "that nobody has allowed: make the run from its study"
    )


def allow(config: Any, folder: str | Path) -> dict[str, str]:
    """Remember the user's consent to what a `Config` starts, for runs in `folder`; returns {key:
    value} of it. Raises ConfigError where the user has no folder of settings."""
    found = settings_of(config)
    if found:
        place = _store()
        if place is None:
            raise ConfigError(
                "nobody knows this user's home; set XDG_CONFIG_HOME, or say it on the command line",
                allowed="; ".join(_flag(key, value) for key, value in found.items()),
            )
        kept = _read(place) | {str(Path(folder).resolve()): remembered(folder) | found}
        write_text(json.dumps(kept, indent=1) + "\n", place)
    return found


def remembered(folder: str | Path) -> dict[str, str]:
    """{key: value} that the user has consented to for runs in a folder."""
    place = _store()
    found = _read(place).get(str(Path(folder).resolve()), {}) if place else {}
    return found if isinstance(found, dict) else {}


def _store() -> Path | None:
    """The user's file of consents; None without a home."""
    if os.environ.get("XDG_CONFIG_HOME"):
        base = Path(os.environ["XDG_CONFIG_HOME"])
    else:
        try:
            base = Path.home() / ".config"
        except RuntimeError:  # no HOME, and nobody knows this user
            return None
    return base / "granular-calibration" / "allowed.json"


def _read(place):
    try:
        found = read_json(place)
    except (OSError, ValueError):
        return {}  # without a consent that can be read, the user is asked again
    return found if isinstance(found, dict) else {}


def _at(data, key):
    for name in key.split("."):
        data = data.get(name) if isinstance(data, Mapping) else None
    return data


def _flag(key, value):
    section, name = key.split(".")
    inside = f"{section}={{{name}: {json.dumps(value, ensure_ascii=False)}}}"
    return f"--config {shlex.quote(inside)}"
