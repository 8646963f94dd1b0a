"""What may start code that is not this project's own, and the consent that a setting in a file
needs.

`docs/starts_code.csv` is the list; the site shows it, and a test holds it against every place in
the sources that starts a program or loads Python. A setting of a configuration that starts code
(`SETTINGS`) is refused until the user consents. There are two ways: the same value on the command
line, or `calibration allow STUDY`, which is remembered for the folder that the study is run in. The
consent is kept in the user's own folder, so no study can bring its own.
"""

import json
import os
import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from calibration.files import read_json, write_text
from calibration.intake.tables import refused

SETTINGS = ("engine.command", "diagnosis.catalogue")

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
        raise refused("unasked", key=key, value=value, study=study, flag=_flag(key, value))


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
            raise refused("no home", flags="; ".join(_flag(k, v) for k, v in found.items()))
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
