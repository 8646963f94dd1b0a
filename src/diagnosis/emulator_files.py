"""Emulators as a file of numbers: arrays as .npz, what belongs together as JSON within. Nothing in
it is executed."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from dem.io.checked import read_checked_arrays, write_checked_arrays
from diagnosis.catalogue import Strength
from diagnosis.design import MultipliedLever
from diagnosis.emulator import Emulator, Moved
from diagnosis.few_runs import FewRuns, WithMechanism

KINDS = ("value", "failure")
"""What an emulator of the file tells of a test."""

CLASSES = {c.__name__: c for c in (Emulator, Chance, FewRuns, WithMechanism)}
"""By the names that the file has for them."""


def write_emulators(
    path: str | Path,
    emulators: Mapping[tuple[str, str], Any],
    failures: Mapping[tuple[str, str], Any] | None = None,
) -> None:
    """Write {(experiment, mechanism): Emulator or Moved}, and of `Chance` in their place the
    failures, atomically and with a checksum."""
    arrays, structure = {}, []  # type: ignore[var-annotated]
    for of, group in (("value", emulators), ("failure", failures or {})):
        for key, emulator in group.items():
            if isinstance(emulator, Moved):
                base = next(k for k, e in group.items() if e is emulator.base)
                part = {"key": key, "base": base, "lever": asdict(emulator.move)}
                structure.append({"of": of} | part)
                continue
            values, number = dict(vars(emulator)), len(structure)
            held = {k: v for k, v in values.items() if isinstance(v, np.ndarray)}
            arrays |= {f"{number}.{name}": array for name, array in held.items()}
            plain = {k: _plain(v) for k, v in values.items() if k not in held}
            own = {"class": type(emulator).__name__, "values": plain, "arrays": list(held)}
            structure.append({"of": of, "key": key} | own)
    text = json.dumps(structure)
    write_checked_arrays(path, arrays | {"structure": np.array(text)})


def _plain(value):
    return value.item() if isinstance(value, np.generic) else value


def read_emulators(
    path: str | Path,
) -> tuple[dict[tuple[str, str], Any], dict[tuple[str, str], Any]]:
    """The emulators and the failures that `write_emulators` wrote. Raises CalibrationError for a
    file that is not as it was written."""
    try:
        arrays = read_checked_arrays(Path(path))
        structure = json.loads(str(arrays["structure"]))
    except (OSError, ValueError, KeyError) as error:
        raise CalibrationError(f"{path}: holds no emulators ({error})") from None
    groups = {of: {} for of in KINDS}  # type: ignore[var-annotated]
    for number, part in enumerate(structure):
        try:
            groups[part["of"]][tuple(part["key"])] = _entry(part, number, arrays, groups)
        except (KeyError, TypeError) as error:
            raise CalibrationError(
                f"{path}: entry {number} is no emulator as this version writes it ({error}); "
                "remove the file, and its stage makes it again"
            ) from None
    return groups["value"], groups["failure"]


def _entry(part, number, arrays, groups):
    """The emulator of one part of the structure, those before it in `groups`."""
    if "values" not in part:
        lever = part["lever"] | {"strength": Strength(**part["lever"]["strength"])}
        return Moved(groups[part["of"]][tuple(part["base"])], MultipliedLever(**lever))
    emulator = object.__new__(CLASSES[part["class"]])
    held = {name: arrays[f"{number}.{name}"] for name in part["arrays"]}
    vars(emulator).update(part["values"] | held)
    return emulator
