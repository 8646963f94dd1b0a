"""What was measured: one table for targets, bench tests, validation and diagnosis.

A row is one reading of a quantity of an experiment, or the mean of n readings with their standard
deviation, under the levers that were set. If a test gave no value, the row says what it ended with.
Every fault is reported with its line and column.
"""

import difflib
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import fmean, stdev

import pandas as pd

from calibration.errors import ConfigError
from calibration.intake import quantities
from calibration.intake.tables import refused
from dem.tables import read_table
from dem.units import UnitError, has_unit, in_ascii, in_unit, question, unit_of

NEEDED = ("experiment", "quantity", "value", "unit")
SPREAD = ("sd", "n")
"""Columns of a mean; empty or left out where each row is one reading."""

SHARED = ("batch", "instrument")
"""Columns that say which rows share an error; empty where they share none."""

ROLES = ("calibrate", "hold out")
OUTCOMES = ("clogged", "arched", "no_heap", "did_not_slide")
"""What a test can end with in place of a value."""

FURTHER = ("test", "replicate", "role", "lever_sd", "outcome")
COLUMNS = (*NEEDED, *SPREAD, *quantities.LEVERS, *SHARED, *FURTHER, "note")
MOST_SPREAD = 1e9
ALIKE_SD = 1e-9
"""Spread of readings that are all alike, as a share of their mean."""

ALIKE = 0.75
"""Likeness (difflib) to a known column from which a further column counts as misspelt."""


@dataclass(frozen=True)
class Measurement:
    """One measured condition: the mean of n replicates with their standard deviation, in the
    quantity's unit. `sd` is None for a single reading.

    `line` is where it stands in its file (its first replicate, where these are rows), None where it
    has none. lever_sd: standard deviation of the lever, in its unit; outcome: what the test
    ended with where it has no value; readings: the values that it is the mean of, where the table
    holds them, and lines: where they stand; covariates: {column: value} of what was recorded beside
    the reading and is no lever, the mean over its readings, and pooled: {column: values} of those
    that differ among these; test: its name in the study's configuration, empty where experiment and
    levers tell it.
    """

    experiment: str
    value: float
    sd: float | None
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
    quantity: str = ""
    test: str = ""
    readings: tuple = field(default=(), compare=False)
    covariates: dict = field(default_factory=dict)
    lines: tuple = field(default=(), compare=False)
    pooled: dict = field(default_factory=dict, compare=False)

    @property
    def lever_error(self) -> float:
        """Error of the reading from that of the lever which it is a share of, to first order."""
        if not self.lever_sd:
            return 0.0
        return self.lever_sd * self.value / self.levers[_share_of(self.experiment)]

    @property
    def condition(self) -> quantities.Condition:
        """The `Condition` that it was measured at."""
        return quantities.Condition(self.experiment, self.levers)

    @property
    def shared(self) -> tuple:
        """Return what replicates share."""
        levers = tuple(sorted(self.levers.items()))
        own = self.experiment, self.quantity, levers, self.batch, self.instrument, self.role
        return *own, self.test

    @property
    def label(self) -> str:
        """Experiment and the levers that are set."""
        levers = ", ".join(f"{k} = {v:g}" for k, v in self.levers.items())
        return f"{self.experiment} ({levers})" if levers else self.experiment


@dataclass(frozen=True)
class Measurements:
    """A table as it was read: its conditions, in the order of their first lines, and how it was
    recognised."""

    path: Path
    conditions: tuple
    how: str

    def of(self, experiment: str, quantity: str) -> list[Measurement]:
        """The conditions of a quantity of an experiment that are to be calibrated on."""
        asked = experiment, quantity, ROLES[0], ""
        return [
            m for m in self.conditions if (m.experiment, m.quantity, m.role, m.outcome) == asked
        ]


class MeasurementErrors(ConfigError):
    """The faults of a file, one a line up to SHOWN; `faults` holds the `ConfigError` of each."""

    SHOWN = 10  # a wrong column is a fault in every row

    def __init__(self, faults: Iterable[ConfigError]) -> None:
        self.faults = list(faults)
        lines = [str(f) for f in self.faults[: self.SHOWN]]
        if len(self.faults) > self.SHOWN:
            lines.append(f"and {len(self.faults) - self.SHOWN} more faults in this file")
        super().__init__("\n".join(lines))


def raise_faults(faults: Sequence[ConfigError]) -> None:
    """Raise the one fault as it is, several as `MeasurementErrors`; none does nothing."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise MeasurementErrors(faults)


def read_measured(path: str | Path, sheet: str | None = None, apart: bool = False) -> Measurements:
    """`Measurements` of a table. Raises ConfigError naming file, line and column of every fault,
    one message a fault.

    sheet: of a workbook with several. apart: whether readings beside which other numbers were
    recorded are other conditions, where of each there are two or more."""
    path = Path(path)
    faults, rows = [], []
    table = read_table(path, lambda header, line: _check_header(path, header, line), sheet)
    if not table.rows:
        raise refused("no reading", path)
    covariates = _covariates(table)
    for line, cells in table.rows:
        row = _Row(table, line, cells)
        found = _measurement(row)
        beside = {c: table.number(line, c, cells[c]) for c in covariates if cells.get(c)}
        rows.append(found and replace(found, covariates=beside))
        faults += row.faults
    conditions = _gathered([r for r in rows if r is not None], path, faults, apart)
    raise_faults(faults)
    return Measurements(path, tuple(conditions), table.how)


def other_settings(path: str | Path) -> str:
    """Return a sentence: at which lever columns the experiments of a table can be set otherwise. It
    stands behind the refusal of a table that says too little; empty for one that cannot be
    read."""
    try:
        kinds = dict.fromkeys(m.experiment for m in read_measured(path).conditions)
    except (ConfigError, OSError):
        return ""
    columns = {kind: " or ".join(quantities.levers_of(kind)) for kind in kinds}
    ways = [f"{kind} at another {own}" for kind, own in columns.items() if own]
    return f" Measure {', or '.join(ways)}." if ways else ""


def _gathered(rows, path, faults, apart):
    """The rows with readings of a condition made one; faults for conditions that come twice."""
    kept, groups = [r for r in rows if r.outcome], {}
    recorded = [tuple(sorted(row.covariates.items())) for row in rows]
    counts = Counter((r.shared, own) for r, own in zip(rows, recorded, strict=True) if r.readings)
    alone = {shared for (shared, _), count in counts.items() if count == 1}
    for row, own in zip(rows, recorded, strict=True):
        if not row.outcome:
            # a mean stands for itself where something else was recorded beside it
            one = row.readings and (not apart or row.shared in alone)
            groups.setdefault((row.shared, () if one else own), []).append(row)
    for own in groups.values():
        means = [m for m in own if not m.readings]
        for m in own[1:] if means else ():
            where = {"line": m.line, "column": "experiment"}
            faults.append(refused("condition twice", path, first=own[0].line, **where))
        named = {}
        for m in (m for m in own if m.replicate):
            first, where = named.setdefault(m.replicate, m), {"column": "replicate"}
            if first is not m:
                where |= {"line": m.line, "value": m.replicate}
                faults.append(refused("replicate twice", path, first=first.line, **where))
        kept.append(own[0] if means else _mean(own))
    return sorted(kept, key=lambda m: m.line)


def _mean(own):
    """`Measurement` of the readings of one condition; a single one has no spread."""
    values = [m.value for m in own]
    if len(values) == 1:
        return own[0]
    sd = max(stdev(values), ALIKE_SD * abs(values[0]))
    mean = {"value": fmean(values), "sd": sd, "n": len(values), "replicate": ""}
    mean["lines"] = tuple(m.line for m in own)
    names = dict.fromkeys(name for m in own for name in m.covariates)
    beside = {name: [m.covariates[name] for m in own if name in m.covariates] for name in names}
    mean["covariates"] = {name: fmean(values) for name, values in beside.items()}
    mean["pooled"] = {k: tuple(v) for k, v in beside.items() if len({*v}) > 1}
    return replace(own[0], **mean, readings=tuple(values))


def _check_header(path, header, line):
    needed = (*NEEDED, *SPREAD) if set(SPREAD) & set(header) else NEEDED
    found, columns = ", ".join(header), ", ".join(NEEDED)
    raise_faults(
        [
            refused("missing column", path, line=line, column=name, value=found, columns=columns)
            for name in needed
            if name not in header
        ]
    )
    raise_faults(
        [
            refused("misspelt column", path, line=line, column=name, near=near[0])
            for name in header
            if name not in COLUMNS and (near := difflib.get_close_matches(name, COLUMNS, 1, ALIKE))
        ]
    )


def _covariates(table):
    """Names of the further columns: each holds numbers and empty cells alone. Raises ConfigError
    for one that holds a text, or nothing."""
    found, faults = [], []
    for name in (n for n in table.header if n not in COLUMNS):
        cells = [(line, row[name]) for line, row in table.rows if row.get(name)]
        try:
            [table.number(line, name, text) for line, text in cells]
        except ConfigError:
            cells = []
        if cells:
            found.append(name)
            continue
        where = {"line": table.header_line, "column": name}
        faults.append(refused("unknown column", table.path, columns=", ".join(COLUMNS), **where))
    raise_faults(faults)
    return found


class _Row:
    """A row of a table while it is read; what is wrong with it goes to `faults`."""

    def __init__(self, table, line, cells):
        self.table, self.line, self.cells = table, line, cells
        self.faults: list[ConfigError] = []

    def get(self, column):
        """Text of a cell, empty where there is none."""
        return self.cells.get(column) or ""

    def fault(self, key, column, **facts):
        """Note what is wrong with a cell."""
        where = {"line": self.line, "column": column}
        self.faults.append(refused(key, self.table.path, **where, **facts))

    def number(self, column, low, high, unit=None):
        """Number of a cell, in `unit` where it carries one of its own; None where it is wrong."""
        text = self.get(column)
        if not text:
            self.fault("missing value" if column == "value" else "missing number", column)
            return None
        try:
            inside = partial(in_unit, unit=unit)
            value = self.table.number(self.line, column, text, inside, finite=False)
        except ConfigError as error:
            self.faults.append(error)
            return None
        if not low <= value <= high:
            self.fault("out of range", column, value=value, low=low, high=high)
            return None
        return value


def _measurement(row):
    """`Measurement` of a `_Row`, or None where it has faults."""
    kind = row.get("experiment")
    if kind not in quantities.QUANTITIES:
        known = ", ".join(quantities.QUANTITIES)
        row.fault("experiment", "experiment", value=kind, known=known)
        return None
    known, name = quantities.measurable(kind), row.get("quantity")
    if name not in known:
        row.fault("quantity", "quantity", value=name, kind=kind, known=", ".join(known))
    q = known.get(name, known[quantities.QUANTITIES[kind].name])
    unit = _unit(row, q)
    text = {c: row.get(c) for c in ("note", *SHARED, "replicate", "test")}
    chosen = _chosen(row)
    scale = _scale(unit, q.unit) if unit else 1.0
    _refuse_superfluous(row, chosen["outcome"])
    value, sd, n = _reading(row, q, scale, unit, chosen["outcome"])
    if n is not None and n != int(n):
        row.fault("whole number", "n", value=n)
    levers, lever_sd = _levers(row, kind), _lever_sd(row, kind)
    if value is not None and not has_unit(row.get("value").replace(",", ".")):
        # a number without a unit of its own that no material has
        if asked := question(q.key, scale * value):
            row.fault("doubtful", "value", value=row.get("value"), asked=asked)
    if row.faults:
        return None
    more = text | chosen | {"quantity": name, "line": row.line}
    if chosen["outcome"]:
        return Measurement(kind, math.nan, math.nan, int(n), levers, **more)
    value = value if scale == 1.0 else scale * value
    sd = sd if scale == 1.0 or sd is None else scale * sd
    if q.below and value >= levers.get(q.below, math.inf):
        row.fault("too high", "value", value=value, lever=q.below, limit=levers[q.below])
        return None
    more |= {"lever_sd": lever_sd, "readings": (value,) if sd is None else ()}
    return Measurement(kind, value, sd, int(n), levers, **more)


def _refuse_superfluous(row, outcome):
    """Faults of cells that mean nothing beside an outcome or in the row of a replicate."""
    beside = "outcome" if outcome else "replicate"
    empty = ("value", "sd") if outcome else SPREAD if row.get("replicate") else ()
    for column in (c for c in empty if row.get(c)):
        row.fault("superfluous", column, value=row.get(column), beside=beside)


def _reading(row, quantity, scale, unit, outcome):
    """(value, sd, n) of a row. A test without a value has a number only. A reading counts as one
    and has no sd."""
    if outcome:
        return None, None, row.number("n", 1, 1e6) if row.get("n") else 1.0
    value = row.number("value", quantity.least / scale, quantity.most / scale, unit)
    if row.get("replicate") or (not row.get("sd") and row.get("n") in ("", "1")):
        return value, None, 1.0
    sd = row.number("sd", 0.0, min(quantity.most, MOST_SPREAD) / scale, unit)
    if sd is not None and value is not None:
        # readings that were rounded to one value scatter by nothing
        sd = max(sd, ALIKE_SD * abs(value))
    return value, sd, row.number("n", 1, 1e6)


def _chosen(row):
    """{role, outcome} of a row; what is not known is a fault."""
    out = {"role": row.get("role") or ROLES[0], "outcome": row.get("outcome")}
    for column, allowed in (("role", ROLES), ("outcome", ("", *OUTCOMES))):
        if out[column] not in allowed:
            known = ", ".join(a or "empty" for a in allowed)
            row.fault("unknown word", column, value=out[column], known=known)
    return out


def _share_of(kind):
    """The lever that the quantity of an experiment is a share of, else None."""
    return getattr(quantities.QUANTITIES[kind].scale, "lever", None)


def _lever_sd(row, kind):
    """Standard deviation of the lever that the quantity is a share of; 0 where none is given."""
    if not row.get("lever_sd"):
        return 0.0
    lever = _share_of(kind)
    if lever is None or row.get("quantity") != quantities.QUANTITIES[kind].name:
        known = ", ".join(filter(_share_of, quantities.QUANTITIES))
        row.fault("lever_sd", "lever_sd", value=row.get("lever_sd"), kind=kind, known=known)
        return 0.0
    return row.number("lever_sd", 0.0, quantities.levers_of(kind)[lever].most, unit_of(lever))


def _unit(row, quantity):
    """Unit of a row's value: the quantity's, or one that converts to it; else a fault."""
    stated = row.get("unit") or row.table.units.get("value", "")
    if not quantity.unit:
        stated = "" if stated == "1" else stated
    try:
        if stated or quantity.unit:
            _scale(stated, quantity.unit or None)
        return stated or quantity.unit
    except UnitError:
        facts = {"value": stated, "kind": row.get("experiment"), "own": quantity.unit}
        row.fault("measured unit" if quantity.unit else "measured number", "unit", **facts)
        return quantity.unit


def _scale(stated, unit):
    """Number of `unit` in one of the unit `stated`. Units that are spelled alike need no library,
    which takes half a second to load. Raises UnitError."""
    return 1.0 if in_ascii(stated) == in_ascii(unit) else in_unit(f"1 {stated}", unit)


def _levers(row, kind):
    """{lever: value} of the levers that are set."""
    levers, own = {}, quantities.levers_of(kind)
    for name in quantities.LEVERS:
        text = row.get(name)
        if not text:
            if name in own and own[name].needed:
                row.fault("needed lever", name, kind=kind)
        elif name not in own:
            known = ", ".join(k for k in quantities.QUANTITIES if name in quantities.levers_of(k))
            row.fault("no lever", name, value=text, kind=kind, known=known)
        else:
            levers[name] = row.number(name, own[name].least, own[name].most, unit_of(name))
    return levers


def readings_table(
    experiment: str,
    quantity: str | Sequence[str],
    values: Sequence[str],
    unit: str,
    notes: Sequence[str],
) -> pd.DataFrame:
    """Readings (n,) of a quantity as the table that `read_measured` reads, a row a reading."""
    rows = {"experiment": experiment, "quantity": quantity, "value": values, "unit": unit}
    return pd.DataFrame(rows | {"note": notes})
