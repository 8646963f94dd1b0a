"""What was measured: one table for targets, bench tests, validation and diagnosis.

A row is one reading of a quantity of an experiment, or the mean of n readings with their standard
deviation, under the levers that were set. If a test gave no value, the row says what it ended with.
Every fault is reported with its line and column.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import fmean, stdev

import pandas as pd

from calibration.errors import ConfigError
from calibration.intake.numbers_with_units import AT_ITS_WORD
from calibration.intake.quantities import (
    LEVERS,
    QUANTITIES,
    Condition,
    having,
    levers_of,
    measurable,
)
from calibration.intake.tables import read_table
from dem.units import UnitError, has_unit, in_unit, question, unit_of

NEEDED = ("experiment", "quantity", "value", "unit")
SPREAD = ("sd", "n")
"""Columns of a mean; empty or left out where each row is one reading."""

SHARED = ("batch", "instrument")
"""Columns that say which rows share an error; empty where they share none."""

ROLES = ("calibrate", "hold out")
OUTCOMES = ("clogged", "arched", "no_heap", "did_not_slide")
"""What a test can end with in place of a value."""

FURTHER = ("replicate", "role", "lever_sd", "outcome")
COLUMNS = (*NEEDED, *SPREAD, *LEVERS, *SHARED, *FURTHER, "note")
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
    holds them, and lines: where they stand; known: ((factor, value), ...) of another code's run;
    covariates: {column: value} of what was recorded beside the reading and is no lever, the mean
    over its readings.
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
    readings: tuple = field(default=(), compare=False)
    known: tuple = ()
    covariates: dict = field(default_factory=dict)
    lines: tuple = field(default=(), compare=False)

    @property
    def proportional(self) -> str | None:
        """The lever that the reading goes with: the needed one, where the quantity is a share of
        it; else None."""
        return getattr(QUANTITIES[self.experiment].scale, "lever", None)

    @property
    def lever_error(self) -> float:
        """Error of the reading from that of its lever, to first order."""
        return self.lever_sd * self.value / self.levers[self.proportional] if self.lever_sd else 0.0

    @property
    def condition(self) -> Condition:
        """The `Condition` that it was measured at."""
        return Condition(self.experiment, self.levers)

    @property
    def shared(self) -> tuple:
        """What replicates share."""
        levers = tuple(sorted(self.levers.items()))
        own = self.experiment, self.quantity, levers, self.batch, self.instrument, self.role
        return *own, self.known

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


def read_measured(
    path: str | Path, parameters: Collection[str] = (), sheet: str | None = None
) -> Measurements:
    """`Measurements` of a table. Raises ConfigError naming file, line and column of every fault,
    one message a fault.

    parameters: factors whose values each row gives in a column of that name, for runs of another
    code that take the place of measurements. sheet: of a workbook with several."""
    path = Path(path)
    faults, rows = [], []
    table = read_table(
        path, lambda header, line: _check_header(path, header, line, parameters), sheet
    )
    if not table.rows:
        raise ConfigError("holds no reading", path=path, allowed="a row for each reading")
    covariates = _covariates(table, parameters)
    for line, row in table.rows:
        own = []  # type: ignore[var-annotated]
        found = _measurement(table, row, line, own, parameters)
        rows.append(found and replace(found, covariates=_recorded(table, row, line, covariates)))
        faults += own
    conditions = _gathered([r for r in rows if r is not None], path, faults)
    raise_faults(faults)
    return Measurements(path, tuple(conditions), table.how)


def _gathered(rows, path, faults):
    """The rows with readings of a condition made one; faults for conditions that come twice."""
    kept, groups = [r for r in rows if r.outcome], {}
    for row in rows:
        if not row.outcome:
            # a mean stands for itself where something else was recorded beside it
            own = () if row.readings else tuple(sorted(row.covariates.items()))
            groups.setdefault((row.shared, own), []).append(row)
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
    mean["covariates"] = {
        name: fmean(m.covariates[name] for m in own if name in m.covariates) for name in names
    }
    return replace(own[0], **mean, readings=tuple(values))


def _check_header(path, header, line, parameters=()):
    needed = (*NEEDED, *SPREAD) if set(SPREAD) & set(header) else NEEDED
    needed = (*needed, *parameters)
    where = {"path": path, "line": line}
    found, allowed = ", ".join(header), ", ".join((*NEEDED, *parameters))
    missing = [name for name in needed if name not in header]
    raise_faults(
        [
            ConfigError("is missing", column=name, value=found, allowed=allowed, **where)
            for name in missing
        ]
    )
    known = (*COLUMNS, *parameters)
    misspelt = {
        name: difflib.get_close_matches(name, known, 1, ALIKE)
        for name in header
        if name not in known
    }
    raise_faults(
        [
            ConfigError("is no known column", column=name, allowed=f"{near[0]}, it seems", **where)
            for name, near in misspelt.items()
            if near
        ]
    )


def _covariates(table, parameters):
    """Names of the further columns: each holds numbers and empty cells alone. Raises ConfigError
    for one that holds a text, or nothing."""
    known = (*COLUMNS, *parameters)
    found, faults = [], []
    for name in (n for n in table.header if n not in known):
        cells = [(line, row[name]) for line, row in table.rows if row.get(name)]
        try:
            [table.number(line, name, text) for line, text in cells]
        except ConfigError:
            cells = []
        if cells:
            found.append(name)
            continue
        where = {"path": table.path, "line": table.header_line, "column": name}
        allowed = f"{', '.join(known)}, or a column of numbers that were recorded beside"
        faults.append(ConfigError("is no known column", **where, allowed=allowed))
    raise_faults(faults)
    return found


def _recorded(table, row, line, names):
    """{column: value} of the covariates of a row that are given."""
    return {name: table.number(line, name, row[name]) for name in names if row.get(name)}


def _number(table, row, line, column, unit, low, high):
    """Number of a cell, in `unit` where it carries one of its own."""
    text, where = row.get(column, ""), {"path": table.path, "line": line, "column": column}
    if not text:
        instead = {"value": "a number, or what the test ended with in the column outcome"}
        raise ConfigError("is missing", **where, allowed=instead.get(column))
    value = table.number(line, column, text, partial(in_unit, unit=unit), finite=False)
    if not low <= value <= high:
        raise ConfigError("is out of range", **where, value=value, allowed=f"{low:g} to {high:g}")
    return value


def _measurement(table, row, line, faults, parameters=()):
    """`Measurement` of a row, or None with what is wrong appended to `faults`."""
    kind, path = row["experiment"], table.path
    if kind not in QUANTITIES:
        allowed = ", ".join(QUANTITIES)
        where = {"path": path, "line": line, "column": "experiment"}
        faults.append(ConfigError("is no experiment", value=kind, allowed=allowed, **where))
        return None
    known = measurable(kind)
    if row["quantity"] not in known:
        where = {"path": path, "line": line, "column": "quantity"}
        reason, allowed = f"does not go with {kind}", ", ".join(known)
        faults.append(ConfigError(reason, value=row["quantity"], allowed=allowed, **where))
    q = known.get(row["quantity"], known[QUANTITIES[kind].name])
    unit = _unit(table, row, q, line, faults)

    def number(column, least, most, own=None):
        try:
            return _number(table, row, line, column, own, least, most)
        except ConfigError as error:
            faults.append(error)
            return None

    text = {c: row.get(c) or "" for c in ("note", *SHARED, "replicate")}
    chosen = _chosen(row, path, line, faults)
    scale = in_unit(f"1 {unit}", q.unit) if unit else 1.0
    faults += _superfluous(row, chosen, path, line)
    value, sd, n = _reading(row, q, scale, unit, number, chosen["outcome"])
    if n is not None and n != int(n):
        where = {"path": path, "line": line, "column": "n"}
        faults.append(ConfigError("is not a whole number", value=n, **where))
    levers = _levers(row, kind, path, line, number, faults)
    lever_sd = _lever_sd(row, kind, path, line, number, faults)
    known = tuple((name, number(name, -math.inf, math.inf)) for name in parameters)
    if value is not None:
        _doubt(table, row, line, q, scale * value, faults)
    if faults:
        return None
    more = text | chosen | {"quantity": row["quantity"], "line": line, "known": known}
    if chosen["outcome"]:
        return Measurement(kind, math.nan, math.nan, int(n), levers, **more)
    value = value if scale == 1.0 else scale * value
    sd = sd if scale == 1.0 or sd is None else scale * sd
    if q.below and value >= levers.get(q.below, math.inf):
        allowed = f"less than {q.below} = {levers[q.below]:g}"
        where = {"path": path, "line": line, "column": "value"}
        faults.append(ConfigError("is too high", value=value, allowed=allowed, **where))
        return None
    more |= {"lever_sd": lever_sd, "readings": (value,) if sd is None else ()}
    return Measurement(kind, value, sd, int(n), levers, **more)


def _superfluous(row, chosen, path, line):
    """Faults of cells that mean nothing beside an outcome or in the row of a replicate."""
    beside = "outcome" if chosen["outcome"] else "replicate" if row.get("replicate") else None
    empty = {"outcome": ("value", "sd"), "replicate": SPREAD, None: ()}[beside]
    return [
        ConfigError(
            f"has no meaning beside {beside}", path=path, line=line, column=c, value=row[c],
            allowed="empty",
        )
        for c in empty
        if row.get(c)
    ]  # fmt: skip


def _reading(row, quantity, scale, unit, number, outcome):
    """(value, sd, n) of a row. A test without a value has a number only. A reading counts as one
    and has no sd."""
    if outcome:
        return None, None, number("n", 1, 1e6) if row.get("n") else 1.0
    value = number("value", quantity.least / scale, quantity.most / scale, unit)
    if row.get("replicate") or (not row.get("sd") and row.get("n", "") in ("", "1")):
        return value, None, 1.0
    most = min(quantity.most, MOST_SPREAD) / scale
    sd = number("sd", 0.0, most, unit)
    if sd is not None and value is not None:
        # readings that were rounded to one value scatter by nothing
        sd = max(sd, ALIKE_SD * abs(value))
    return value, sd, number("n", 1, 1e6)


def _chosen(row, path, line, faults):
    """{role, outcome} of a row; what is not known is a fault."""
    out = {"role": row.get("role") or ROLES[0], "outcome": row.get("outcome") or ""}
    for column, allowed in (("role", ROLES), ("outcome", ("", *OUTCOMES))):
        if out[column] not in allowed:
            where = {"path": path, "line": line, "column": column, "value": out[column]}
            known = ", ".join(a or "empty" for a in allowed)
            faults.append(ConfigError("is not known", **where, allowed=known))
    return out


def _lever_sd(row, kind, path, line, number, faults):
    """Standard deviation of the lever that the quantity is a share of; 0 where none is given."""
    if not row.get("lever_sd"):
        return 0.0
    lever = getattr(QUANTITIES[kind].scale, "lever", None)
    if lever is None or row["quantity"] != QUANTITIES[kind].name:
        where = {"path": path, "line": line, "column": "lever_sd", "value": row["lever_sd"]}
        known = [k for k, q in QUANTITIES.items() if hasattr(q.scale, "lever")]
        allowed = f"empty, or a row of {', '.join(known)}"
        faults.append(ConfigError(f"is not known for {kind}", **where, allowed=allowed))
        return 0.0
    return number("lever_sd", 0.0, levers_of(kind)[lever].most, unit_of(lever))


def _unit(table, row, quantity, line, faults):
    """Unit of a row's value: the quantity's, or one that converts to it; else a fault."""
    stated = row["unit"] or table.units.get("value", "")
    if not quantity.unit:
        stated = "" if stated == "1" else stated
    try:
        if stated or quantity.unit:
            in_unit(f"1 {stated}", quantity.unit or None)
        return stated or quantity.unit
    except UnitError:
        where = {"path": table.path, "line": line, "column": "unit"}
        reason = f"does not go with {row['experiment']}"
        allowed = f"{quantity.unit}, or what converts to it" if quantity.unit else "no unit"
        faults.append(ConfigError(reason, value=stated, allowed=allowed, **where))
        return quantity.unit


def _doubt(table, row, line, quantity, value, faults):
    """A fault for a number without a unit of its own that no material has."""
    own = has_unit(row["value"].replace(",", "."))
    asked = None if own else question(quantity.key, value)
    if asked:
        where = {"path": table.path, "line": line, "column": "value"}
        text = row["value"]
        faults.append(
            ConfigError(f"is doubtful: {asked}", value=text, allowed=AT_ITS_WORD, **where)
        )


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
