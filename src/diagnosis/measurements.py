"""Measured conditions: a tidy table, a row a condition; every fault is reported with its line and column."""

import csv
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from calibration.errors import ConfigError
from diagnosis.quantities import LEVERS, QUANTITIES

NEEDED = {"drop": "drop_height_mm", "shear": "normal_stress_kPa"}
COLUMNS = ("experiment", "quantity", "value", "unit", "sd", "n", *LEVERS, "note")
LEAST_CONDITIONS = 3


@dataclass(frozen=True)
class Measurement:
    """One measured condition: mean of n replicates with their standard deviation, in the quantity's unit.

    `line` is where it stands in its file, None where it has none.
    """

    experiment: str
    value: float
    sd: float
    n: int
    levers: dict
    note: str = ""
    line: int | None = field(default=None, compare=False)

    @property
    def label(self):
        """Experiment and the levers that are set."""
        levers = ", ".join(f"{k} = {v:g}" for k, v in self.levers.items())
        return f"{self.experiment} ({levers})" if levers else self.experiment


class MeasurementErrors(ConfigError):
    """All faults of a file, one a line; `faults` holds the `ConfigError` of each."""

    def __init__(self, faults):
        self.faults = list(faults)
        super().__init__("\n".join(str(f) for f in self.faults))


def raise_faults(faults):
    """Raise the one fault as it is, several as `MeasurementErrors`; none does nothing."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise MeasurementErrors(faults)


def read_measurements(path):
    """List of `Measurement`. Raises ConfigError naming file, line and column of every fault, one message a fault."""
    path = Path(path)
    faults, seen, out = [], {}, []
    for line, row in _rows(path):
        own = []
        measured = _measurement(row, path, line, own)
        faults += own
        if own:
            continue
        key = (measured.experiment, tuple(sorted(measured.levers.items())))
        if key in seen:
            reason = (
                f"repeats the condition of line {seen[key]}: give its replicates as one row with n"
            )
            faults.append(ConfigError(reason, path=path, line=line, column="experiment"))
        seen.setdefault(key, line)
        out.append(measured)
    raise_faults(faults)
    _enough(out, path)
    return out


def _enough(measurements, path):
    """Raise ConfigError where no data could tell one mechanism from another."""
    if len(measurements) < LEAST_CONDITIONS:
        raise ConfigError(
            "has too few conditions to tell anything apart",
            path=path,
            value=len(measurements),
            allowed=f"at least {LEAST_CONDITIONS} rows",
        )
    for kind in {m.experiment for m in measurements}:
        for lever in LEVERS:
            if len({m.levers.get(lever) for m in measurements if m.experiment == kind}) > 1:
                return
    raise ConfigError(
        "has no experiment at two settings of a lever: a single setting is met by the parameters alone",
        path=path,
        allowed="two rows or more of an experiment that differ in a lever column",
    )


def _rows(path):
    """[(line, {column: text})]. Raises ConfigError for an unreadable file, its header or a row that is too long."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ConfigError("is not text", path=path, allowed="UTF-8") from None
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    kept = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.lstrip().startswith("#")]
    if not kept:
        raise ConfigError("is empty", path=path, allowed=f"columns {', '.join(COLUMNS)}")
    header = _header(path, *kept[0])
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


def _header(path, line, text):
    header = [h.strip() for h in next(csv.reader([text]))]
    faults = [
        ConfigError("is missing", path=path, line=line, column=name)
        for name in COLUMNS[:6]
        if name not in header
    ]
    allowed = ", ".join(COLUMNS)
    for k, name in enumerate(header):
        if name not in COLUMNS:
            reason = "is no known column"
        elif name in header[:k]:
            reason = "stands twice"
        else:
            continue
        faults.append(ConfigError(reason, path=path, line=line, column=name, allowed=allowed))
    raise_faults(faults)
    return header


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


def _measurement(row, path, line, faults):
    """`Measurement` of a row, or None with what is wrong appended to `faults`."""
    kind = row["experiment"]
    if kind not in QUANTITIES:
        allowed = ", ".join(QUANTITIES)
        where = {"path": path, "line": line, "column": "experiment"}
        faults.append(ConfigError("is no experiment", value=kind, allowed=allowed, **where))
        return None
    q = QUANTITIES[kind]
    for column, wanted in (("quantity", q.name), ("unit", q.unit)):
        if row[column] != wanted:
            where = {"path": path, "line": line, "column": column}
            reason = f"does not go with {kind}"
            faults.append(ConfigError(reason, value=row[column], allowed=wanted, **where))

    def number(column, least, most):
        try:
            return _number(row, column, path, line, least, most)
        except ConfigError as error:
            faults.append(error)
            return None

    value, sd, n = number("value", q.least, q.most), number("sd", 1e-9, q.most), number("n", 1, 1e6)
    if n is not None and n != int(n):
        faults.append(
            ConfigError("is not a whole number", path=path, line=line, column="n", value=n)
        )
    levers = _levers(row, kind, path, line, number, faults)
    if faults:
        return None
    if kind == "drop" and value >= levers["drop_height_mm"]:
        allowed = f"less than drop_height_mm = {levers['drop_height_mm']:g}"
        where = {"path": path, "line": line, "column": "value"}
        faults.append(ConfigError("rebounds too high", value=value, allowed=allowed, **where))
        return None
    return Measurement(kind, value, sd, int(n), levers, row.get("note", ""), line)


def _levers(row, kind, path, line, number, faults):
    """{lever: value} of the levers that are set."""
    levers = {}
    for name, lever in LEVERS.items():
        where = {"path": path, "line": line, "column": name}
        if not row.get(name):
            if NEEDED.get(kind) == name:
                faults.append(ConfigError(f"is needed for {kind}", **where))
        elif kind not in lever.experiments:
            allowed = f"empty, or a row of {', '.join(lever.experiments)}"
            faults.append(
                ConfigError(f"is no lever of {kind}", value=row[name], allowed=allowed, **where)
            )
        else:
            levers[name] = number(name, lever.least, lever.most)
    return levers


def to_table(measurements):
    """The measurements as the table that `read_measurements` reads."""
    rows = []
    for m in measurements:
        q = QUANTITIES[m.experiment]
        fixed = (m.experiment, q.name, m.value, q.unit, m.sd, m.n)
        rows.append(dict(zip(COLUMNS[:6], fixed, strict=True)) | m.levers | {"note": m.note})
    return pd.DataFrame(rows, columns=list(COLUMNS))
