"""The one call of the diagnosis: a table in, what verdict.json says out."""

import csv
import tempfile
from functools import cache
from pathlib import Path

import pandas as pd
import yaml

from diagnosis import contacts
from diagnosis.catalogue import load_catalogue
from diagnosis.measurements import read_measurements
from diagnosis.rig import Rig
from diagnosis.settings import read_settings

ROOT = Path(__file__).parents[3]


@cache
def study():
    """Rig and catalogue of the shipped study."""
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())["run"]
    return Rig(read_settings(ROOT / "config/diagnosis.yaml"), base), load_catalogue()


def ask(table: pd.DataFrame) -> dict:
    """What the diagnosis says of a table, read from a file as a user's table is: the keys of
    verdict.json, without the gain that needs runs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "measurements.csv"
        table.to_csv(path, index=False, quoting=csv.QUOTE_MINIMAL)
        measurements = read_measurements(path)
    return spoken(contacts.discovered(measurements, *study()))


def spoken(found) -> dict:
    """The agreed keys, out of what was found."""
    laws = [{"names": list(found.causes), "forms": [], **found.law}] if found.law else []
    for name in () if laws else found.causes:
        known = study()[1][name]
        slot, state = known.law or (None, ())
        laws.append({"experiment": known.experiments[0], "slot": slot, "state": list(state),
                     "names": list(found.causes), "forms": []})  # fmt: skip
    rivals = [{k: t[k] for k in ("experiment", "slot", "state") if k in t}
              for t in (found.law or {}).get("tied", ()) if isinstance(t, dict)]  # fmt: skip
    return {
        "verdict": found.verdict,
        "misfit": None,
        "laws": laws,
        "errors": list(found.scatter),
        "rows": [{"line": r["line"], "standard_deviations": r["standard_deviations"]}
                 for r in found.outliers],
        "rivals": rivals,
        "reason": found.reason,
        "next_measurement": found.next_setting,
        "exclusion": None,
    }  # fmt: skip
