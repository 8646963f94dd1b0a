"""The one call of the diagnosis: a table in, what verdict.json says out."""

import tempfile
from functools import cache
from pathlib import Path

import pandas as pd

from benchmarks.rates.simulated import salt_heap, salt_settings
from diagnosis import contacts
from diagnosis.catalogue import load_catalogue
from diagnosis.measurements import read_all
from diagnosis.rig import Rig
from diagnosis.table_model.law import limits


@cache
def study():
    """Rig and catalogue of the shipped study."""
    base = salt_heap()
    return Rig(salt_settings(), base), load_catalogue()


def ask(table: pd.DataFrame, engine: bool = False) -> dict:
    """Return what the diagnosis says of a table, read from a file as a user's table is: the keys of
    verdict.json. engine: with the gain of each law, by runs."""
    rig, catalogue = study()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "measurements.csv"
        table.to_csv(path, index=False)
        measured = read_all(path)
    found = contacts.discovered(measured.fitted, rig, catalogue, measured.aside)
    assert found is not None  # every table has what free laws are sought in
    said = contacts.of_found(found, rig.settings.alpha)
    if engine:
        return contacts.with_engine(said, measured.fitted, found, rig, catalogue)
    return said | {"exclusion": limits(found.selection.blocks, catalogue)}
