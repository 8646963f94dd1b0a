"""The folder of printed tables, read as text so that no printed digit is lost: its figures with the
rounding that their digits allow, its claims, and what is found for one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import ConfigError
from calibration.intake.tables import read_written

GROUP = 5
"""Readings of a group of Table 1, in the order of the print."""
SENTENCES = ("agrees", "disagrees", "unknown")
"""Columns of claims.csv that say what each verdict means for a reader."""
FACTORS = tuple("ABCDEFG")
"""The paper's letters of the factors of Tables 5 to 7."""
NAMES = {
    "X": "salt_salt_rolling_friction",
    "Y": "salt_salt_restitution",
    "Z": "salt_steel_rolling_friction",
}
"""Axes of Tables 10 and 11: factor."""
MEASURED = {
    "measured_inclined_plane_angle": ("tilt", "sliding_angle"),
    "measured_rebound_height": ("drop", "rebound_height"),
}
"""Name of a single figure -> experiment and quantity of its row in measurements.csv."""


@dataclass(frozen=True)
class Printed:
    """A printed number: its value, half a unit in its last printed place, and its relation ('', '<'
    or '>')."""

    text: str
    value: float
    half_unit: float
    relation: str = ""

    @classmethod
    def parse(cls, text: str) -> "Printed | None":
        """The number in `text`, or None where the text is not one number.

        >>> Printed.parse("0.40").half_unit
        0.005
        >>> Printed.parse("<0.0001").relation
        '<'
        """
        text = text.strip()
        relation = text[:1] if text.startswith(("<", ">")) else ""
        try:
            number = Decimal(text.removeprefix(relation).strip())
        except InvalidOperation:
            return None
        if not number.is_finite():
            return None
        half_unit = 0.5 * 10.0 ** int(number.as_tuple().exponent)
        return cls(text, float(number), half_unit, relation)


def propagate(f: Callable[[Sequence[float]], float], inputs: Sequence[Printed]) -> float:
    """Largest change of `f(values)` when each input moves by half a unit in its last printed place,
    to first order."""
    values = [x.value for x in inputs]
    centre = f(values)
    moved = ([*values[:i], x.value + x.half_unit, *values[i + 1 :]] for i, x in enumerate(inputs))
    return float(sum(abs(f(point) - centre) for point in moved))


class AuditInputError(ConfigError):
    """A folder of printed tables that lacks something or holds something unreadable: file, line,
    column, and the row's name as `key`."""


def printed_number(text: str, **where: Any) -> Printed:
    """The number in a text; raises AuditInputError where it is none."""
    number = Printed.parse(text)
    if number is None:
        raise AuditInputError("is not a number", value=text, **where)
    return number


@dataclass(frozen=True)
class Claim:
    """One statement of the paper: where it stands, what it says, the printed value and its unit.
    sentences: {"agrees", "disagrees", "unknown": what each verdict means for a reader}."""

    id: str
    where: str
    claim: str
    printed: str
    unit: str
    sentences: dict[str, str] = field(default_factory=dict)

    @property
    def group(self) -> str:
        """First part of the id, as `table08` of `table08.low`."""
        return self.id.split(".")[0]

    @property
    def part(self) -> str:
        """Second part of the id, as `low` of `table08.low`."""
        return self.id.split(".")[1]

    @property
    def value(self) -> float:
        """The printed number; raises AuditInputError where it is none."""
        return printed_number(self.printed, path="claims.csv", key=self.id).value


class Found:
    """What the tables give for a claim: a number, a text, or None where they do not determine it.

    half_width : what the rounding of printed inputs adds to the tolerance, in the claim's unit
    exact : a setting or an exponent, which has no rounding; an integer, a count, is always exact
    holds : whether the claim holds, where that is not equality with `value` within the tolerance
    printed : the printed text, where it stands in a table and not in claims.csv
    names : what the claim's id and sentences are filled with, beside value, printed and unit
    """

    def __init__(
        self, value: Any, half_width: float = 0.0, exact: bool = False, holds: bool | None = None,
        printed: str | None = None, **names: Any,
    ) -> None:  # fmt: skip
        self.value = value.item() if isinstance(value, np.generic) else value
        self.half_width, self.holds, self.printed, self.names = half_width, holds, printed, names
        self.exact = exact or isinstance(self.value, int)

    def compared(self, text: str) -> tuple[bool | None, float | None]:
        """(whether the claim that is printed as `text` holds, None where it cannot be computed; the
        tolerance, where this is a comparison within one)."""
        printed = Printed.parse(text)
        if self.value is None or self.holds is not None:
            return self.holds, None
        if printed is None or isinstance(self.value, str):
            return text.strip() == str(self.value).strip(), None
        if printed.relation:
            below = self.value < printed.value
            return (below if printed.relation == "<" else self.value > printed.value), None
        tolerance = 0.0 if self.exact else printed.half_unit + self.half_width
        # A decimal half unit is not exact in binary: allow it its last bits.
        slack = 1e-9 * max(abs(printed.value), tolerance)
        return abs(self.value - printed.value) <= tolerance + slack, tolerance


Claims = dict[str, Callable[["Paper", Claim], Any]]
"""{ids of claims.csv, with spaces between: what the printed tables give for each}: a value, a
`Found`, or {end of the id: Found} where the claim stands for several rows."""
Row = dict[str, Any]
Rows = str | Callable[["Paper"], list[Row]]
Cells = dict[str, tuple[Rows, str, Callable[["Paper", Row], Any]]]
"""{row of cell_claims.csv: (file, or rows of other texts; its columns that are judged, with spaces
between; what the printed tables give for a cell: a value or a `Found`)}. A row has its texts by
column, its number as `row`, and as `cell` the column of the cell that is judged."""


class Paper:
    """The printed tables in `folder` (see data/paper/README.md for the files)."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise AuditInputError("no such folder of printed tables", path=self.folder)
        self._texts: dict[str, pd.DataFrame] = {}

    def has(self, name: str) -> bool:
        """Return whether the file `name`.csv is there."""
        return (self.folder / f"{name}.csv").is_file()

    def text(self, name: str, *columns: str) -> pd.DataFrame:
        """The table `name`.csv as printed; raises AuditInputError where it, or one of `columns`, is
        missing."""
        path = self.folder / f"{name}.csv"
        if name not in self._texts:
            if not path.is_file():
                raise AuditInputError("missing", path=path)
            # Not pandas' `comment`, which would also cut a "#" inside a sentence.
            head = sum(1 for line in path.read_text("utf-8").splitlines() if line.startswith("#"))
            self._texts[name] = read_written(path, skiprows=head, dtype=str, keep_default_na=False)
        table = self._texts[name]
        lacking = [c for c in columns if c not in table.columns]
        if lacking:
            raise AuditInputError(
                "no such column", path=path, column=lacking[0], allowed=", ".join(table.columns)
            )
        return table

    def numbers(self, name: str, *columns: str) -> pd.DataFrame:
        """The named columns (all where none is named) of `name`.csv as float64."""
        table = self.text(name, *columns)
        return pd.DataFrame(
            {c: [p.value for p in self.printed(name, c)] for c in columns or table.columns}
        )

    def printed(self, name: str, column: str) -> list[Printed]:
        """The cells of a column with their printed digits; raises AuditInputError at a cell that is
        no number."""
        path = self.folder / f"{name}.csv"
        return [
            printed_number(text, path=path, key=f"row {row}", column=column)
            for row, text in enumerate(self.text(name, column)[column], start=1)
        ]

    def keyed(self, name: str, key: str, *columns: str) -> pd.DataFrame:
        """The named columns of `name`.csv as float64, by the texts of its column `key`."""
        return self.numbers(name, *columns).set_axis(self.text(name, key)[key])

    def measured(self, experiment: str, quantity: str) -> list[str]:
        """The printed values of a quantity in measurements.csv."""
        table = self.text("measurements", "experiment", "quantity", "value")
        own = (table["experiment"] == experiment) & (table["quantity"] == quantity)
        return list(table.loc[own, "value"])

    def angles(self) -> pd.DataFrame:
        """Table 1: `group` and `angle_deg` of the 25 measured angles of repose."""
        angles = np.array(self.measured("heap", "angle_of_repose"), float)
        return pd.DataFrame({"group": np.arange(len(angles)) // GROUP + 1.0, "angle_deg": angles})

    @cached_property
    def _scalars(self) -> dict[str, str]:
        found = {}
        for name, asked in MEASURED.items():
            own = self.measured(*asked)
            if len(own) != 1:
                raise AuditInputError(
                    f"{len(own)} rows", path=self.folder / "measurements.csv",
                    key=", ".join(asked), allowed="one",
                )  # fmt: skip
            found[name] = own[0]
        for file in ("scalars", "settings", "reference_values"):
            table = self.text(file, "name", "value")
            found |= dict(zip(table["name"], table["value"], strict=True))
        return found

    def scalar_text(self, name: str) -> str:
        """The printed text of a single figure of scalars.csv, settings.csv, reference_values.csv or
        measurements.csv. Raises AuditInputError where none of them has it."""
        if name not in self._scalars:
            raise AuditInputError(
                "no such row, neither here nor in settings.csv",
                path=self.folder / "scalars.csv", key=name,
            )  # fmt: skip
        return self._scalars[name]

    def scalar(self, name: str) -> Printed:
        """A single figure with its printed digits. Raises AuditInputError for a text that is no
        number."""
        return printed_number(self.scalar_text(name), path=self.folder, key=name)

    def value(self, name: str) -> float:
        """A single figure."""
        return self.scalar(name).value

    def miss(self, name: str, measured: str) -> float:
        """Return what a single figure is off a measured one [%]."""
        target = self.value(measured)
        return 100 * abs(self.value(name) - target) / target

    def optional(self, name: str) -> float | None:
        """A single figure, or None where no file holds it."""
        return self.value(name) if name in self._scalars else None

    @cached_property
    def claims(self) -> dict[str, Claim]:
        """The rows of claims.csv by id, `=name` put in."""
        claims = {}
        told = self.text("claims", "id", "where", "claim", "printed", "unit", *SENTENCES)
        for row in told.to_dict("records"):
            text = row["printed"]
            if text.startswith("=") and text != "=table":
                row["printed"] = self.scalar_text(text[1:])
            sentences = {name: row.pop(name) for name in SENTENCES}
            claims[row["id"]] = Claim(**row, sentences=sentences)
        return claims


@dataclass(frozen=True)
class Table:
    """A table of simulated values: the experiment, its file, the column of the values, their unit.
    Of a sweep also the column of its parameter, the equation that is fitted to it, and where the
    measured value and that of the runs at its inverse stand."""

    experiment: str
    file: str
    column: str
    unit: str
    parameter: str = ""
    equation: str = ""
    measured: str = ""
    confirmed: str = ""

    def points(self, paper: Paper) -> tuple[np.ndarray, np.ndarray]:
        """Parameter (n,) and value (n,) of a sweep."""
        return tuple(paper.numbers(self.file, self.parameter, self.column).to_numpy().T)

    def curve(self, paper: Paper) -> list[Printed]:
        """The printed quadratic's coefficients, highest power first."""
        name = f"{self.equation}_coefficients"
        texts = paper.scalar_text(name).split()
        return [printed_number(text, path=paper.folder, key=name) for text in texts]


TABLES = {
    "Table 6": Table("heap", "table06_plackett_burman", "angle_deg", "deg"),
    "Table 8": Table(
        "tilt", "table08_inclined_plane", "angle_deg", "deg", "salt_steel_static_friction", "eq21",
        "measured_inclined_plane_angle", "simulated_tilt_angle",
    ),
    "Table 9": Table(
        "drop", "table09_drop_test", "rebound_height_mm", "mm", "salt_steel_restitution", "eq23",
        "measured_rebound_height", "simulated_rebound_at_0.421",
    ),
    "Table 10": Table("heap", "table10_steepest_ascent", "angle_deg", "deg"),
    "Table 11": Table("heap", "table11_box_behnken", "angle_deg", "deg"),
}  # fmt: skip


def levels(paper: Paper, item: str) -> pd.DataFrame:
    """The factors' levels of a table's rows, in natural units."""
    table = TABLES[item]
    if item == "Table 6":
        ranges = paper.keyed("table05_contact_parameter_ranges", "factor", "low", "high")
        names = paper.text("table05_contact_parameter_ranges", "name")["name"]
        return _natural(paper.numbers(table.file, *ranges.index), ranges).set_axis(names, axis=1)
    if table.parameter:
        return paper.numbers(table.file, table.parameter)
    found = paper.numbers(table.file, *NAMES)
    if item == "Table 11":
        found = _natural(found, paper.keyed("table11_coding", "factor", "low", "high"))
    return found.rename(columns=NAMES)


def _natural(coded, ranges):
    """Coded levels in natural units; ranges: low and high of each column."""
    low, high = ranges["low"], ranges["high"]
    return np.round(0.5 * (low + high) + 0.5 * coded * (high - low), 9)
