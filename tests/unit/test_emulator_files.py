"""Trained emulators come back from their file to the bit, and the file can hold nothing that is
executed."""

import json
import pickle
import re

import numpy as np
import pytest

from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from dem.io.checked import read_checked_arrays, write_checked_arrays
from diagnosis.catalogue import Strength
from diagnosis.design import MultipliedLever
from diagnosis.emulator import Emulator, Moved
from diagnosis.emulator_files import read_emulators, write_emulators
from facts import refused

LEVER = MultipliedLever(1, 0.7, Strength("factor", "-", 0.8, 1.25, log=True, off=1.0))


@pytest.fixture(scope="module")
def emulators():
    rng = np.random.default_rng(1)
    x = rng.random((14, 2))
    base = Emulator(x, x[:, 0] + 0.1 * rng.standard_normal(14), scatters=True)
    return {("drop", "base"): base, ("drop", "size_bias"): Moved(base, LEVER)}


def test_emulators_come_back_as_they_were(emulators, tmp_path):
    chance = Chance(
        np.random.default_rng(3).random((9, 2)), [0, 1, 0, 0, 1, 0, 0, 0, 1], np.ones(9)
    )
    failures = {("heap", "base"): chance, ("heap", "size_bias"): Moved(chance, LEVER)}
    write_emulators(tmp_path / "emulators.npz", emulators, failures)
    back, failing = read_emulators(tmp_path / "emulators.npz")
    assert list(back) == list(emulators)
    assert list(failing) == list(failures)
    points = np.random.default_rng(2).random((5, 3))
    for key, emulator in emulators.items():
        x = points if key[1] == "size_bias" else points[:, :2]
        columns = [0, x.shape[1] - 1]
        for a, b in zip(
            emulator.with_slope(x, columns), back[key].with_slope(x, columns), strict=True
        ):
            np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(emulator.correlation(x), back[key].correlation(x))
    for key, chance in failures.items():
        x = points if key[1] == "size_bias" else points[:, :2]
        for a, b in zip(
            chance.with_slope(x, [0])[:2], failing[key].with_slope(x, [0])[:2], strict=True
        ):
            np.testing.assert_array_equal(a, b)


class Planted:
    """What a stranger could leave in a shared folder."""

    def __reduce__(self):
        return (open, ("planted", "w"))


def test_a_pickle_is_refused_and_not_executed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "emulators.npz").write_bytes(pickle.dumps(Planted()))
    with refused(CalibrationError, "emulators.npz"):
        read_emulators("emulators.npz")
    assert [p.name for p in tmp_path.iterdir()] == ["emulators.npz"]


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays, parts: arrays.pop("0.alpha"),
        lambda arrays, parts: parts[0].update(of="weather"),
        lambda arrays, parts: parts[0].pop("key"),
        lambda arrays, parts: parts[1].update(base=["drop", "cohesion"]),
        lambda arrays, parts: parts[1]["lever"].update(colour="red"),
    ],
    ids=["array", "kind", "key", "base", "lever"],
)
def test_an_entry_that_is_missing_or_foreign_is_told(emulators, tmp_path, change):
    path = tmp_path / "emulators.npz"
    write_emulators(path, emulators)
    arrays = dict(read_checked_arrays(path))
    parts = json.loads(str(arrays["structure"]))
    change(arrays, parts)
    write_checked_arrays(path, arrays | {"structure": np.array(json.dumps(parts))})
    with refused(CalibrationError, "emulators.npz") as error:
        read_emulators(path)
    assert re.search(r"entry [01]\b", str(error.value))
