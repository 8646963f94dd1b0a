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
from calibration.intake.tables import AT_ITS_WORD, read_table
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
    has none. lever_sd: standard deviation of `proportional`, in its unit; outcome: what the test
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
    def proportional(self) -> str | None:
        """The lever that the reading goes with: the needed one, where the quantity is a share of
        it; else None."""
        return getattr(quantities.QUANTITIES[self.experiment].scale, "lever", None)

    @property
    def lever_error(self) -> float:
        """Error of the reading from that of its lever, to first order."""
        return self.lever_sd * self.value / self.levers[self.proportional] if self.lever_sd else 0.0

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
        raise ConfigError("holds no reading", path=path, allowed="a row for each reading")
    covariates = _covariates(table)
    for line, cells in table.rows:
        row = _Row(table, line, cells)
        found = _measurement(row)
        rows.append(found and replace(found, covariates=_recorded(table, cells, line, covariates)))
        faults += row.faults
    conditions = _gathered([r for r in rows if r is not None], path, faults, apart)
    raise_faults(faults)
    return Measurements(path, tuple(conditions), table.how)


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
        faults += [_twice(m, own[0], path) for m in own[1:] if means]
        faults += _same_name(own, path)
        kept.append(own[0] if means else _mean(own))
    return sorted(kept, key=lambda m: m.line)


def _twice(row, first, path):
    reason = (
        f"repeats the condition of line {first.line}: give its replicates as one row with n, or "
        "each as a row without sd and n, or say in batch or instrument what differs"
    )
    return ConfigError(reason, path=path, line=row.line, column="experiment")


def _same_name(own, path):
    """Faults of replicates that bear the name of an earlier one."""
    names = [m.replicate for m in own]
    return [
        ConfigError(
            f"repeats the replicate of line {own[names.index(m.replicate)].line}",
            path=path, line=m.line, column="replicate", value=m.replicate,
        )
        for k, m in enumerate(own)
        if m.replicate and names.index(m.replicate) != k
    ]  # fmt: skip


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
    where = {"path": path, "line": line}
    found, allowed = ", ".join(header), ", ".join(NEEDED)
    missing = [name for name in needed if name not in header]
    raise_faults(
        [
            ConfigError("is missing", column=name, value=found, allowed=allowed, **where)
            for name in missing
        ]
    )
    misspelt = {
        name: difflib.get_close_matches(name, COLUMNS, 1, ALIKE)
        for name in header
        if name not in COLUMNS
    }
    raise_faults(
        [
            ConfigError("is no known column", column=name, allowed=f"{near[0]}, it seems", **where)
            for name, near in misspelt.items()
            if near
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
        where = {"path": table.path, "line": table.header_line, "column": name}
        allowed = f"{', '.join(COLUMNS)}, or a column of numbers that were recorded beside"
        faults.append(ConfigError("is no known column", **where, allowed=allowed))
    raise_faults(faults)
    return found


def _recorded(table, row, line, names):
    """{column: value} of the covariates of a row that are given."""
    return {name: table.number(line, name, row[name]) for name in names if row.get(name)}


class _Row:
    """A row of a table while it is read; what is wrong with it goes to `faults`."""

    def __init__(self, table, line, cells):
        self.table, self.line, self.cells = table, line, cells
        self.faults: list[ConfigError] = []

    def get(self, column):
        """Text of a cell, empty where there is none."""
        return self.cells.get(column) or ""

    def fault(self, column, reason, **told):
        """Note what is wrong with a cell."""
        where = {"path": self.table.path, "line": self.line, "column": column}
        self.faults.append(ConfigError(reason, **where, **told))

    def number(self, column, low, high, unit=None):
        """Number of a cell, in `unit` where it carries one of its own; None where it is wrong."""
        text = self.get(column)
        if not text:
            instead = {"value": "a number, or what the test ended with in the column outcome"}
            self.fault(column, "is missing", allowed=instead.get(column))
            return None
        try:
            inside = partial(in_unit, unit=unit)
            value = self.table.number(self.line, column, text, inside, finite=False)
        except ConfigError as error:
            self.faults.append(error)
            return None
        if not low <= value <= high:
            self.fault(column, "is out of range", value=value, allowed=f"{low:g} to {high:g}")
            return None
        return value


def _measurement(row):
    """`Measurement` of a `_Row`, or None where it has faults."""
    kind = row.get("experiment")
    if kind not in quantities.QUANTITIES:
        row.fault(
            "experiment", "is no experiment", value=kind, allowed=", ".join(quantities.QUANTITIES)
        )
        return None
    known, name = quantities.measurable(kind), row.get("quantity")
    if name not in known:
        reason, allowed = f"does not go with {kind}", ", ".join(known)
        row.fault("quantity", reason, value=name, allowed=allowed)
    q = known.get(name, known[quantities.QUANTITIES[kind].name])
    unit = _unit(row, q)
    text = {c: row.get(c) for c in ("note", *SHARED, "replicate", "test")}
    chosen = _chosen(row)
    scale = _scale(unit, q.unit) if unit else 1.0
    _refuse_superfluous(row, chosen["outcome"])
    value, sd, n = _reading(row, q, scale, unit, chosen["outcome"])
    if n is not None and n != int(n):
        row.fault("n", "is not a whole number", value=n)
    levers, lever_sd = _levers(row, kind), _lever_sd(row, kind)
    if value is not None and not has_unit(row.get("value").replace(",", ".")):
        # a number without a unit of its own that no material has
        if asked := question(q.key, scale * value):
            said = row.get("value")
            row.fault("value", f"is doubtful: {asked}", value=said, allowed=AT_ITS_WORD)
    if row.faults:
        return None
    more = text | chosen | {"quantity": name, "line": row.line}
    if chosen["outcome"]:
        return Measurement(kind, math.nan, math.nan, int(n), levers, **more)
    value = value if scale == 1.0 else scale * value
    sd = sd if scale == 1.0 or sd is None else scale * sd
    if q.below and value >= levers.get(q.below, math.inf):
        allowed = f"less than {q.below} = {levers[q.below]:g}"
        row.fault("value", "is too high", value=value, allowed=allowed)
        return None
    more |= {"lever_sd": lever_sd, "readings": (value,) if sd is None else ()}
    return Measurement(kind, value, sd, int(n), levers, **more)


def _refuse_superfluous(row, outcome):
    """Faults of cells that mean nothing beside an outcome or in the row of a replicate."""
    beside = "outcome" if outcome else "replicate"
    empty = ("value", "sd") if outcome else SPREAD if row.get("replicate") else ()
    for column in (c for c in empty if row.get(c)):
        reason = f"has no meaning beside {beside}"
        row.fault(column, reason, value=row.get(column), allowed="empty")


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
            row.fault(column, "is not known", value=out[column], allowed=known)
    return out


def _lever_sd(row, kind):
    """Standard deviation of the lever that the quantity is a share of; 0 where none is given."""
    if not row.get("lever_sd"):
        return 0.0
    lever = getattr(quantities.QUANTITIES[kind].scale, "lever", None)
    if lever is None or row.get("quantity") != quantities.QUANTITIES[kind].name:
        known = [k for k, q in quantities.QUANTITIES.items() if hasattr(q.scale, "lever")]
        allowed = f"empty, or a row of {', '.join(known)}"
        reason = f"is not known for {kind}"
        row.fault("lever_sd", reason, value=row.get("lever_sd"), allowed=allowed)
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
        allowed = f"{quantity.unit}, or what converts to it" if quantity.unit else "no unit"
        reason = f"does not go with {row.get('experiment')}"
        row.fault("unit", reason, value=stated, allowed=allowed)
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
                row.fault(name, f"is needed for {kind}")
        elif name not in own:
            allowed = f"empty, or a row of {', '.join(quantities.having(name))}"
            row.fault(name, f"is no lever of {kind}", value=text, allowed=allowed)
        else:
            levers[name] = row.number(name, own[name].least, own[name].most, unit_of(name))
    return levers


def readings_table(
    experiment: str,
    quantity: str,
    values: Sequence[str],
    unit: str,
    notes: Sequence[str] | None = None,
) -> pd.DataFrame:
    """Readings (n,) of a quantity as the table that `read_measured` reads, a row a reading."""
    rows = {"experiment": experiment, "quantity": quantity, "value": values, "unit": unit}
    return pd.DataFrame(rows | ({"note": notes} if notes else {}))
