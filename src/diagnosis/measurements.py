"""Measured conditions: a tidy table, a row a condition; every fault is reported with its line and
column."""

import math
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import fmean, stdev

import pandas as pd

from calibration.errors import ConfigError
from calibration.tables import read_table
from dem.units import UnitError, in_unit, unit_of
from diagnosis.quantities import LEVERS, QUANTITIES, having, levers_of

SHARED = ("batch", "instrument")
"""Columns that say which rows share an error; empty where they share none."""

ROLES = ("calibrate", "hold out")
OUTCOMES = ("clogged", "arched", "no_heap", "did_not_slide")
"""What a test can end with in place of a value."""

FURTHER = ("replicate", "role", "lever_sd", "outcome")
COLUMNS = ("experiment", "quantity", "value", "unit", "sd", "n", *LEVERS, *SHARED, *FURTHER, "note")
LEAST_CONDITIONS = 3
LEAST_SETTINGS = 5
"""Of the experiments that a cause shows on, for it to be named: of fewer the errors between them
cannot be known, and a day of another humidity looks like a law."""


@dataclass(frozen=True)
class Measurement:
    """One measured condition: mean of n replicates with their standard deviation, in the quantity's
    unit.

    `line` is where it stands in its file (its first replicate, where these are rows), None where it
    has none. lever_sd: standard deviation of `proportional`, in its unit; outcome: what the test
    ended with where it has no value.
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
    replicate: str = ""
    role: str = ROLES[0]
    lever_sd: float = 0.0
    outcome: str = ""

    @property
    def proportional(self):
        """The lever that the reading goes with: the needed one, where the quantity is a share of
        it; else None."""
        return getattr(QUANTITIES[self.experiment].scale, "lever", None)

    @property
    def lever_error(self):
        """Error of the reading from that of its lever, to first order."""
        return self.lever_sd * self.value / self.levers[self.proportional] if self.lever_sd else 0.0

    @property
    def condition(self):
        """What replicates share."""
        levers = tuple(sorted(self.levers.items()))
        return self.experiment, levers, self.batch, self.instrument, self.role

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


@dataclass(frozen=True)
class Measured:
    """All rows of a table: conditions to calibrate on, those held out, tests without a value."""

    fitted: list
    held_out: list
    outcomes: list


def read_measurements(path):
    """List of `Measurement` to calibrate on. Raises ConfigError naming file, line and column of
    every fault, one message a fault."""
    return read_all(path).fitted


def read_all(path):
    """`Measured` of a table; raises as `read_measurements`."""
    path = Path(path)
    faults, rows = [], []
    table = read_table(path, lambda header, line: _check_header(path, header, line))
    for line, row in table.rows:
        own = []
        rows.append(_measurement(table, row, line, own))
        faults += own
    rows = _gathered([r for r in rows if r is not None], path, faults)
    raise_faults(faults)
    valued = [r for r in rows if not r.outcome]
    out = Measured(
        [r for r in valued if r.role == ROLES[0]],
        [r for r in valued if r.role != ROLES[0]],
        [r for r in rows if r.outcome],
    )
    _enough(out.fitted, path)
    return out


def _gathered(rows, path, faults):
    """The rows with replicates of a condition made one; faults for conditions that come twice."""
    out, replicates = {}, {}
    for row in rows:
        if row.replicate:
            replicates.setdefault(row.condition, []).append(row)
        elif row.condition in out and not row.outcome and not out[row.condition].outcome:
            reason = (
                f"repeats the condition of line {out[row.condition].line}: give its replicates as "
                "one row with n, or each with a name in replicate, or say in batch or instrument "
                "what differs"
            )
            faults.append(ConfigError(reason, path=path, line=row.line, column="experiment"))
        else:
            out[row.condition, row.line] = out[row.condition] = row
    kept = [row for key, row in out.items() if isinstance(key[-1], int)]
    for condition, own in replicates.items():
        kept += _mean(own, out.get(condition), path, faults)
    return sorted(kept, key=lambda m: m.line)


def _mean(own, whole, path, faults):
    """[`Measurement`] of the replicates of one condition."""
    names, count = [m.replicate for m in own], len(faults)
    for k, m in enumerate(own):
        where = {"path": path, "line": m.line, "column": "replicate", "value": m.replicate}
        if whole is not None:
            faults.append(ConfigError(f"has its condition's mean in line {whole.line}", **where))
        elif names.index(m.replicate) != k:
            first = own[names.index(m.replicate)].line
            faults.append(ConfigError(f"repeats the replicate of line {first}", **where))
        elif len(own) == 1:
            reason = "is the only one of its condition, whose spread cannot be known"
            allowed = "two replicates or more, or one row with sd and n"
            faults.append(ConfigError(reason, **where, allowed=allowed))
    if len(faults) > count:
        return []
    values = [m.value for m in own]
    sd = max(stdev(values), 1e-9 * abs(own[0].value))
    return [replace(own[0], value=fmean(values), sd=sd, n=len(own), replicate="")]


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
        for name in COLUMNS[: 4 if "replicate" in header else 6]
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

    text = {c: row.get(c) or "" for c in ("note", *SHARED, "replicate")}
    chosen = _chosen(row, path, line, faults)
    scale = in_unit(f"1 {unit}", q.unit)
    beside = "outcome" if chosen["outcome"] else "replicate" if text["replicate"] else None
    faults += _superfluous(row, beside, path, line)
    value, sd, n = _reading(row, q, scale, unit, number, beside)
    if n is not None and n != int(n):
        faults.append(
            ConfigError("is not a whole number", path=path, line=line, column="n", value=n)
        )
    levers = _levers(row, kind, path, line, number, faults)
    lever_sd = _lever_sd(row, q, kind, path, line, number, faults)
    if faults:
        return None
    if chosen["outcome"]:
        return Measurement(kind, math.nan, math.nan, int(n), levers, line=line, **text, **chosen)
    value, sd = (value, sd) if unit == q.unit else (scale * value, scale * sd)
    if q.below and value >= levers.get(q.below, math.inf):
        allowed = f"less than {q.below} = {levers[q.below]:g}"
        where = {"path": path, "line": line, "column": "value"}
        faults.append(ConfigError("is too high", value=value, allowed=allowed, **where))
        return None
    more = text | chosen | {"lever_sd": lever_sd}
    return Measurement(kind, value, sd, int(n), levers, line=line, **more)


def _superfluous(row, beside, path, line):
    """Faults of cells that mean nothing beside an outcome or in the row of a replicate."""
    empty = {"outcome": ("value", "sd"), "replicate": ("sd", "n"), None: ()}[beside]
    return [
        ConfigError(
            f"has no meaning beside {beside}", path=path, line=line, column=c, value=row[c],
            allowed="empty",
        )
        for c in empty
        if row.get(c)
    ]  # fmt: skip


def _reading(row, quantity, scale, unit, number, beside):
    """(value, sd, n) of a row; a test without a value has a number only, a replicate stands for
    one."""
    if beside == "outcome":
        return math.nan, math.nan, number("n", 1, 1e6) if row.get("n") else 1.0
    value = number("value", quantity.least / scale, quantity.most / scale, unit)
    if beside == "replicate":
        return value, 0.0, 1.0
    return value, number("sd", 1e-9 / scale, quantity.most / scale, unit), number("n", 1, 1e6)


def _chosen(row, path, line, faults):
    """{role, outcome} of a row; what is not known is a fault."""
    out = {"role": row.get("role") or ROLES[0], "outcome": row.get("outcome") or ""}
    for column, allowed in (("role", ROLES), ("outcome", ("", *OUTCOMES))):
        if out[column] not in allowed:
            where = {"path": path, "line": line, "column": column, "value": out[column]}
            known = ", ".join(a or "empty" for a in allowed)
            faults.append(ConfigError("is not known", **where, allowed=known))
    return out


def _lever_sd(row, quantity, kind, path, line, number, faults):
    """Standard deviation of the lever that the quantity is a share of; 0 where none is given."""
    if not row.get("lever_sd"):
        return 0.0
    lever = getattr(quantity.scale, "lever", None)
    if lever is None:
        where = {"path": path, "line": line, "column": "lever_sd", "value": row["lever_sd"]}
        known = [k for k, q in QUANTITIES.items() if hasattr(q.scale, "lever")]
        allowed = f"empty, or a row of {', '.join(known)}"
        faults.append(ConfigError(f"is not known for {kind}", **where, allowed=allowed))
        return 0.0
    return number("lever_sd", 0.0, levers_of(kind)[lever].most, unit_of(lever))


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
        rows[-1] |= {name: getattr(m, name) for name in (*SHARED, *FURTHER)}
        rows[-1]["lever_sd"] = m.lever_sd or ""
    return pd.DataFrame(rows, columns=list(COLUMNS))
