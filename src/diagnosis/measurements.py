"""Measured conditions: a tidy table, a row a condition; every fault is reported with its line and
column."""

import math
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pandas as pd

from calibration.errors import ConfigError
from calibration.tables import read_table
from dem.units import UnitError, in_unit, unit_of
from diagnosis.quantities import LEVERS, QUANTITIES, having, levers_of

SHARED = ("batch", "instrument")
"""Columns that say which rows share an error; empty where they share none."""

COLUMNS = ("experiment", "quantity", "value", "unit", "sd", "n", *LEVERS, *SHARED, "note")
LEAST_CONDITIONS = 3
LEAST_SETTINGS = 5
"""Of the experiments that a cause shows on, for it to be named: of fewer the errors between them
cannot be known, and a day of another humidity looks like a law."""


@dataclass(frozen=True)
class Measurement:
    """One measured condition: mean of n replicates with their standard deviation, in the quantity's
    unit.

    `line` is where it stands in its file, None where it has none.
    """

    experiment: str
    value: float
    sd: float
    n: int
    levers: dict
    note: str = ""
    line: int | None = field(default=None, compare=False)
    batch: str = ""
    instrument: str = ""

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
    """List of `Measurement`. Raises ConfigError naming file, line and column of every fault, one
    message a fault."""
    path = Path(path)
    faults, seen, out = [], {}, []
    table = read_table(path, lambda header, line: _check_header(path, header, line))
    for line, row in table.rows:
        own = []
        measured = _measurement(table, row, line, own)
        faults += own
        if own:
            continue
        shared = (measured.batch, measured.instrument)
        key = (measured.experiment, tuple(sorted(measured.levers.items())), *shared)
        if key in seen:
            reason = (
                f"repeats the condition of line {seen[key]}: give its replicates as one row with "
                f"n, "
                "or say in batch or instrument what differs"
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
        "has no experiment at two settings of a lever: a single setting is met by the parameters "
        "alone",
        path=path,
        allowed="two rows or more of an experiment that differ in a lever column",
    )


def _check_header(path, header, line):
    faults = [
        ConfigError("is missing", path=path, line=line, column=name)
        for name in COLUMNS[:6]
        if name not in header
    ]
    allowed = ", ".join(COLUMNS)
    faults += [
        ConfigError("is no known column", path=path, line=line, column=name, allowed=allowed)
        for name in header
        if name not in COLUMNS
    ]
    raise_faults(faults)


def _number(table, row, line, column, unit, low, high):
    """Number of a cell, in `unit` where it carries one of its own."""
    text, where = row.get(column, ""), {"path": table.path, "line": line, "column": column}
    if not text:
        raise ConfigError("is missing", **where)
    value = table.number(line, column, text, partial(in_unit, unit=unit), finite=False)
    if not low <= value <= high:
        raise ConfigError("is out of range", **where, value=value, allowed=f"{low:g} to {high:g}")
    return value


def _measurement(table, row, line, faults):
    """`Measurement` of a row, or None with what is wrong appended to `faults`."""
    kind, path = row["experiment"], table.path
    if kind not in QUANTITIES:
        allowed = ", ".join(QUANTITIES)
        where = {"path": path, "line": line, "column": "experiment"}
        faults.append(ConfigError("is no experiment", value=kind, allowed=allowed, **where))
        return None
    q = QUANTITIES[kind]
    if row["quantity"] != q.name:
        where = {"path": path, "line": line, "column": "quantity"}
        reason = f"does not go with {kind}"
        faults.append(ConfigError(reason, value=row["quantity"], allowed=q.name, **where))
    unit = _unit(row, q, path, line, faults)

    def number(column, least, most, own=None):
        try:
            return _number(table, row, line, column, own, least, most)
        except ConfigError as error:
            faults.append(error)
            return None

    scale = in_unit(f"1 {unit}", q.unit)
    value, sd = (number(c, least / scale, q.most / scale, unit)
                 for c, least in (("value", q.least), ("sd", 1e-9)))  # fmt: skip
    n = number("n", 1, 1e6)
    if n is not None and n != int(n):
        faults.append(
            ConfigError("is not a whole number", path=path, line=line, column="n", value=n)
        )
    levers = _levers(row, kind, path, line, number, faults)
    if faults:
        return None
    value, sd = (value, sd) if unit == q.unit else (scale * value, scale * sd)
    if q.below and value >= levers.get(q.below, math.inf):
        allowed = f"less than {q.below} = {levers[q.below]:g}"
        where = {"path": path, "line": line, "column": "value"}
        faults.append(ConfigError("is too high", value=value, allowed=allowed, **where))
        return None
    note, batch, instrument = (row.get(c, "") for c in ("note", *SHARED))
    return Measurement(kind, value, sd, int(n), levers, note, line, batch, instrument)


def _unit(row, quantity, path, line, faults):
    """Unit of a row's value: the quantity's, or one that converts to it; else a fault."""
    try:
        in_unit(f"1 {row['unit']}", quantity.unit)
        return row["unit"] or quantity.unit
    except UnitError:
        where = {"path": path, "line": line, "column": "unit"}
        reason = f"does not go with {row['experiment']}"
        allowed = f"{quantity.unit}, or what converts to it"
        faults.append(ConfigError(reason, value=row["unit"], allowed=allowed, **where))
        return quantity.unit


def _levers(row, kind, path, line, number, faults):
    """{lever: value} of the levers that are set."""
    levers, own = {}, levers_of(kind)
    for name in LEVERS:
        where = {"path": path, "line": line, "column": name}
        if not row.get(name):
            if name in own and own[name].needed:
                faults.append(ConfigError(f"is needed for {kind}", **where))
        elif name not in own:
            allowed = f"empty, or a row of {', '.join(having(name))}"
            faults.append(
                ConfigError(f"is no lever of {kind}", value=row[name], allowed=allowed, **where)
            )
        else:
            levers[name] = number(name, own[name].least, own[name].most, unit_of(name))
    return levers


def to_table(measurements):
    """The measurements as the table that `read_measurements` reads."""
    rows = []
    for m in measurements:
        q = QUANTITIES[m.experiment]
        fixed = (m.experiment, q.name, m.value, q.unit, m.sd, m.n)
        rows.append(dict(zip(COLUMNS[:6], fixed, strict=True)) | m.levers | {"note": m.note})
        rows[-1] |= {name: getattr(m, name) for name in SHARED}
    return pd.DataFrame(rows, columns=list(COLUMNS))
