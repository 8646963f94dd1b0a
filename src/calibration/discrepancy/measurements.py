"""Measured conditions: a tidy table, a row a condition; the first fault is reported with its line and column."""

import csv
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from calibration.errors import ConfigError

QUANTITIES = {
    "heap": ("angle_of_repose", "deg", 0.0, 90.0),
    "drop": ("rebound_height", "mm", 0.0, 1e4),
    "tilt": ("sliding_angle", "deg", 0.0, 90.0),
    "shear": ("shear_stress", "kPa", 0.0, 1e4),
}
"""Experiment -> quantity, unit, least and largest value."""

LEVERS = {
    "particle_diameter_mm": (1e-3, 100.0),
    "particle_count": (1.0, 5e6),
    "discharge_height_mm": (1.0, 1e4),
    "drop_height_mm": (1.0, 1e4),
    "tilt_rate_deg_s": (1e-3, 90.0),
    "normal_stress_kPa": (1e-3, 1e4),
    "scale_factor": (0.01, 100.0),
    "output_interval_s": (1e-6, 10.0),
}
"""Lever column -> least and largest value."""

APPLIES = {
    "heap": {"particle_diameter_mm", "particle_count", "discharge_height_mm", "scale_factor"},
    "drop": {"particle_diameter_mm", "drop_height_mm", "scale_factor", "output_interval_s"},
    "tilt": {"particle_diameter_mm", "tilt_rate_deg_s", "scale_factor"},
    "shear": {"particle_diameter_mm", "particle_count", "normal_stress_kPa", "scale_factor"},
}
NEEDED = {"drop": "drop_height_mm", "shear": "normal_stress_kPa"}
COLUMNS = ("experiment", "quantity", "value", "unit", "sd", "n", *LEVERS, "note")
LEAST_CONDITIONS = 3


@dataclass(frozen=True)
class Measurement:
    """One measured condition: mean of n replicates with their standard deviation, in the quantity's unit."""

    experiment: str
    value: float
    sd: float
    n: int
    levers: dict
    note: str = ""

    @property
    def label(self):
        """Experiment and the levers that are set."""
        levers = ", ".join(f"{k} = {v:g}" for k, v in self.levers.items())
        return f"{self.experiment} ({levers})" if levers else self.experiment


def read_measurements(path):
    """List of `Measurement`. Raises ConfigError naming file, line and column of the first fault."""
    path = Path(path)
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot be read ({error})", path=path) from None
    kept = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.lstrip().startswith("#")]
    if not kept:
        raise ConfigError("is empty", path=path, allowed=f"columns {', '.join(COLUMNS)}")
    rows = _rows(path, kept)
    seen, out = {}, []
    for line, row in rows:
        measured = _measurement(row, path, line)
        key = (measured.experiment, tuple(sorted(measured.levers.items())))
        if key in seen:
            raise ConfigError(
                f"repeats the condition of line {seen[key]}: give its replicates as one row with n",
                path=path,
                line=line,
                column="experiment",
            )
        seen[key] = line
        out.append(measured)
    if len(out) < LEAST_CONDITIONS:
        raise ConfigError(
            "has too few conditions to tell anything apart",
            path=path,
            value=len(out),
            allowed=f"at least {LEAST_CONDITIONS} rows",
        )
    return out


def _rows(path, kept):
    header = [h.strip() for h in next(csv.reader([kept[0][1]]))]
    for name in COLUMNS[:6]:
        if name not in header:
            raise ConfigError("is missing", path=path, line=kept[0][0], column=name)
    for name in header:
        if name not in COLUMNS:
            raise ConfigError(
                "is no known column",
                path=path,
                line=kept[0][0],
                column=name,
                allowed=", ".join(COLUMNS),
            )
    rows = []
    for line, text in kept[1:]:
        cells = next(csv.reader([text]))
        if len(cells) > len(header):
            raise ConfigError(
                f"has {len(cells)} cells under {len(header)} columns", path=path, line=line
            )
        cells += [""] * (len(header) - len(cells))
        rows.append((line, dict(zip(header, (c.strip() for c in cells), strict=True))))
    return rows


def _number(row, column, path, line, low, high):
    text = row.get(column, "")
    try:
        value = float(text)
    except ValueError:
        reason = "is not a number" if text else "is missing"
        raise ConfigError(reason, path=path, line=line, column=column, value=text or None) from None
    if not low <= value <= high:
        allowed = f"{low:g} to {high:g}"
        raise ConfigError(
            "is out of range", path=path, line=line, column=column, value=value, allowed=allowed
        )
    return value


def _measurement(row, path, line):
    kind = row["experiment"]
    if kind not in QUANTITIES:
        raise ConfigError(
            "is no experiment",
            path=path,
            line=line,
            column="experiment",
            value=kind,
            allowed=", ".join(QUANTITIES),
        )
    quantity, unit, low, high = QUANTITIES[kind]
    for column, wanted in (("quantity", quantity), ("unit", unit)):
        if row[column] != wanted:
            raise ConfigError(
                f"does not go with {kind}",
                path=path,
                line=line,
                column=column,
                value=row[column],
                allowed=wanted,
            )
    value = _number(row, "value", path, line, low, high)
    sd = _number(row, "sd", path, line, 1e-9, high)
    n = _number(row, "n", path, line, 1, 1e6)
    if n != int(n):
        raise ConfigError("is not a whole number", path=path, line=line, column="n", value=n)
    levers = {}
    for name, (least, most) in LEVERS.items():
        if not row.get(name):
            continue
        if name not in APPLIES[kind]:
            allowed = f"empty, or a row of {', '.join(e for e in APPLIES if name in APPLIES[e])}"
            raise ConfigError(
                f"is no lever of {kind}",
                path=path,
                line=line,
                column=name,
                value=row[name],
                allowed=allowed,
            )
        levers[name] = _number(row, name, path, line, least, most)
    if kind in NEEDED and NEEDED[kind] not in levers:
        raise ConfigError(f"is needed for {kind}", path=path, line=line, column=NEEDED[kind])
    return Measurement(kind, value, sd, int(n), levers, row.get("note", ""))


def to_table(measurements):
    """The measurements as the table that `read_measurements` reads."""
    rows = []
    for m in measurements:
        quantity, unit, *_ = QUANTITIES[m.experiment]
        fixed = (m.experiment, quantity, m.value, unit, m.sd, m.n)
        rows.append(dict(zip(COLUMNS[:6], fixed, strict=True)) | m.levers | {"note": m.note})
    return pd.DataFrame(rows, columns=list(COLUMNS))
