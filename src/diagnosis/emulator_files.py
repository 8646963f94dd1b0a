"""Emulators as a file of numbers: arrays as .npz, what belongs together as JSON within. Nothing in
it is executed."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from calibration.errors import CalibrationError
from dem.io.checked import read_checked_arrays, write_checked_arrays
from diagnosis.catalogue import Strength
from diagnosis.design import MultipliedLever
from diagnosis.emulator import Emulator, Multiplied


def write_emulators(path, emulators):
    """Write {(experiment, mechanism): Emulator or Multiplied}, atomically and with a checksum."""
    arrays, structure = {}, []
    for number, (key, emulator) in enumerate(emulators.items()):
        if isinstance(emulator, Multiplied):
            base = next(k for k, e in emulators.items() if e is emulator.base)
            structure.append({"key": key, "base": base, "lever": asdict(emulator.lever)})
            continue
        values = vars(emulator)
        held = {k: v for k, v in values.items() if isinstance(v, np.ndarray)}
        arrays |= {f"{number}.{name}": array for name, array in held.items()}
        plain = {k: _plain(v) for k, v in values.items() if k not in held}
        structure.append({"key": key, "values": plain, "arrays": list(held)})
    text = json.dumps(structure)
    write_checked_arrays(path, arrays | {"structure": np.array(text)})


def _plain(value):
    return value.item() if isinstance(value, np.generic) else value


def read_emulators(path):
    """What `write_emulators` wrote. Raises CalibrationError for a file that is not as it was
    written."""
    try:
        arrays = read_checked_arrays(Path(path))
        structure = json.loads(str(arrays["structure"]))
    except (OSError, ValueError, KeyError) as error:
        raise CalibrationError(f"{path}: holds no emulators ({error})") from None
    found = {}
    for number, part in enumerate(structure):
        key = tuple(part["key"])
        if "values" in part:
            found[key] = emulator = Emulator.__new__(Emulator)
            held = {name: arrays[f"{number}.{name}"] for name in part["arrays"]}
            vars(emulator).update(part["values"] | held)
        else:
            lever = part["lever"] | {"strength": Strength(**part["lever"]["strength"])}
            found[key] = Multiplied(found[tuple(part["base"])], MultipliedLever(**lever))
    return found
