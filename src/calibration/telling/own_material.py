"""What a study found of its material, kept in the folder's library, which `dem new --material`
offers beside the published ranges."""

from pathlib import Path
from shlex import quote
from typing import Any

import pandas as pd

from calibration.errors import CalibrationError
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.study.new.ranges import OWN, WIDE, materials

COLUMNS = ["material", "key", "low", "high", "source"]
STAGES = ("joint", "posterior")
"""Stages that leave an interval of each parameter, the one over more tests first."""


def keep_material(study: Any, results: Path | None = None, name: str | None = None) -> list[str]:
    """Add the parameters that a study bounds to OWN; returns sentences.

    study: `calibration.interface.api.Study`; results: folder of its results, where another profile
    made them; name: of the material, the study's unless given. Raises CalibrationError for a study
    without a posterior, one that bounds nothing, and a material that is there already.
    """
    folder, material = Path(results or study.folder), name or study.name
    if material in materials():
        raise CalibrationError(
            f"{material}: is a material already ({OWN} or published); allowed: another name (--as)"
        )
    stage = next((s for s in STAGES if (folder / s / "parameters.csv").is_file()), None)
    if stage is None:
        raise CalibrationError(
            f"{folder}: has no posterior; allowed: a study whose stage {' or '.join(STAGES)} is "
            "made, and its folder of results where a profile made it (--results)"
        )
    found = read_written(folder / stage / "parameters.csv").set_index("parameter")
    source = f"calibrated: 95 % interval of {folder.as_posix()}, stage {stage}"
    rows = [
        [
            material,
            f.key,
            _short(found.loc[f.name, "low"]),
            _short(found.loc[f.name, "high"]),
            source,
        ]
        for f in study.factors
        if f.name in found.index and f.key in WIDE and bool(found.loc[f.name, "bounded"])
    ]
    if not rows:
        raise CalibrationError(f"{folder}: the measurements bound none of its parameters")
    table = pd.DataFrame(rows, columns=COLUMNS)
    known = [read_written(OWN)] if OWN.is_file() else []
    write_table(pd.concat([*known, table]), OWN)
    left = [f.name for f in study.factors if f.key not in {row[1] for row in rows}]
    ranges = "1 range" if len(rows) == 1 else f"{len(rows)} ranges"
    lines = [f"{material}: {ranges} in {OWN}; dem new FOLDER --material {quote(material)}"]
    why = "not bounded, or true of this size of grain alone"
    return [*lines, f"left out, as {why}: {', '.join(left)}"] if left else lines


def _short(value):
    return float(f"{float(value):.4g}")
