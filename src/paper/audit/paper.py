"""The folder of printed tables, read as text so that no printed digit is lost."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pandas as pd

from calibration.errors import ConfigError
from calibration.intake.tables import read_written
from paper.audit.printed import Printed

GROUP = 5
"""Readings of a group of Table 1, in the order of the print."""
KEYS = ("experiment", "quantity")
MEASURED = {
    "measured_inclined_plane_angle": ("tilt", "sliding_angle"),
    "measured_rebound_height": ("drop", "rebound_height"),
}
"""Name of a single figure -> experiment and quantity of its row in measurements.csv."""


class AuditInputError(ConfigError):
    """A folder of printed tables that lacks something or holds something unreadable: file, line,
    column, and the row's name as `key`."""


@dataclass(frozen=True)
class Claim:
    """One statement of the paper: where it stands, what it says, the printed value and its unit."""

    id: str
    where: str
    claim: str
    printed: str
    unit: str


class Paper:
    """The printed tables in `folder` (see data/paper/README.md for the files)."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise AuditInputError("no such folder of printed tables", path=self.folder)
        self._texts: dict[str, pd.DataFrame] = {}

    def has(self, name: str) -> bool:
        """Whether the file `name`.csv is there."""
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
        parsed = []
        for row, text in enumerate(self.text(name, column)[column], start=1):
            number = Printed.parse(text)
            if number is None:
                raise AuditInputError(
                    "is not a number", path=self.folder / f"{name}.csv", key=f"row {row}",
                    column=column, value=text,
                )  # fmt: skip
            parsed.append(number)
        return parsed

    def angles(self) -> pd.DataFrame:
        """Table 1: `group` and `angle_deg` of the 25 measured angles of repose."""
        table = self.text("measurements", *KEYS, "value")
        own = (table["experiment"] == "heap") & (table["quantity"] == "angle_of_repose")
        angles = table.loc[own, "value"].astype(float).reset_index(drop=True)
        group = angles.index // GROUP + 1
        return pd.DataFrame({"group": group.astype(float), "angle_deg": angles})

    def _measured(self) -> dict[str, str]:
        """Printed text of the single measured figures."""
        table = self.text("measurements", *KEYS, "value")
        found = {}
        for name, asked in MEASURED.items():
            own = list(table.loc[(table[list(KEYS)] == list(asked)).all(axis=1), "value"])
            if len(own) != 1:
                raise AuditInputError(
                    f"{len(own)} rows", path=self.folder / "measurements.csv",
                    key=", ".join(asked), allowed="one",
                )  # fmt: skip
            found[name] = own[0]
        return found

    @cached_property
    def _scalars(self) -> dict[str, str]:
        files = [
            self.text(name, "name", "value") for name in ("scalars", "settings", "reference_values")
        ]
        return self._measured() | {
            name: value
            for file in files
            for name, value in zip(file["name"], file["value"], strict=True)
        }

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
        number = Printed.parse(self.scalar_text(name))
        if number is None:
            raise AuditInputError(
                "is not a number", path=self.folder, key=name, value=self.scalar_text(name)
            )
        return number

    def value(self, name: str) -> float:
        """A single figure."""
        return self.scalar(name).value

    def optional(self, name: str) -> float | None:
        """A single figure, or None where no file holds it."""
        return self.value(name) if name in self._scalars else None

    @cached_property
    def claims(self) -> dict[str, Claim]:
        """The rows of claims.csv by id, `=name` put in. Raises AuditInputError for an id that
        stands twice."""
        columns = ("id", "where", "claim", "printed", "unit")
        claims = {}
        for row in self.text("claims", *columns)[list(columns)].itertuples(index=False):
            text = row.printed
            if text.startswith("=") and text != "=table":
                text = self.scalar_text(text[1:])
            if row.id in claims:
                raise AuditInputError(
                    "the id stands twice", path=self.folder / "claims.csv", key=row.id
                )
            claims[row.id] = Claim(row.id, row.where, row.claim, text, row.unit)
        return claims
