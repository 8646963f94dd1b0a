"""The factors of a calibration: names, the key each sets in a run spec, and levels."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from calibration.errors import ConfigError

COLUMNS = ("code", "name", "key", "low", "high", "description")

RESERVED = {
    "run",
    "replicate",
    "group",
    "path",
    "run_id",
    "response",
    "response_sd",
    "relative_error",
    "desirability",
}


@dataclass(frozen=True)
class Factor:
    """One factor; low and high are its natural levels at -1 and +1."""

    code: str
    name: str
    key: str
    low: float
    high: float
    description: str = ""

    @property
    def centre(self):
        """Natural level at 0."""
        return 0.5 * (self.low + self.high)

    @property
    def half_range(self):
        """Natural units per coded unit."""
        return 0.5 * (self.high - self.low)

    def natural(self, coded):
        """Natural level of a coded one; floats or arrays. Rounded to nine digits: levels name cached runs."""
        value = self.centre + coded * self.half_range
        return round(value, 9) if isinstance(value, float) else value

    def coded(self, natural):
        """Coded level of a natural one."""
        return (natural - self.centre) / self.half_range


def read_factors(path):
    """Factors from a tab-separated table with columns COLUMNS. Raises ConfigError naming file, line and column."""
    path = Path(path)
    try:
        lines = path.read_text().splitlines()
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    except UnicodeDecodeError:
        raise ConfigError("is not text", path=path, allowed="UTF-8") from None
    rows = [(n, x) for n, x in enumerate(lines, 1) if x.strip() and not x.startswith("#")]
    if len(rows) < 2:
        raise ConfigError(
            "has no factors", path=path, allowed=f"a line each, columns {', '.join(COLUMNS)}"
        )
    header = rows[0][1].split("\t")
    missing = [c for c in COLUMNS[:5] if c not in header]
    if missing:
        raise ConfigError(
            f"lacks {', '.join(missing)}", path=path, line=rows[0][0], allowed=", ".join(COLUMNS)
        )
    factors = []
    for line, row in zip(
        (n for n, _ in rows[1:]),
        csv.reader((x for _, x in rows[1:]), delimiter="\t", quoting=csv.QUOTE_NONE),
        strict=True,
    ):
        factors.append(_factor(dict(zip(header, row, strict=False)), path, line))
    for field in ("code", "name", "key"):
        values = [getattr(f, field) for f in factors]
        for v in values:
            if values.count(v) > 1:
                raise ConfigError("stands twice", path=path, column=field, value=v)
    # codes and names are the columns of the design tables
    taken = {f.code for f in factors} | RESERVED
    for f in factors:
        for field, used in (("code", RESERVED), ("name", taken)):
            if getattr(f, field) in used:
                raise ConfigError(
                    "is the name of another column of the design tables",
                    path=path,
                    column=field,
                    value=getattr(f, field),
                )
    return factors


def factor_of(factors, key):
    """The factor that sets the dotted `key` of a run spec. Raises ConfigError where none does."""
    for factor in factors:
        if factor.key == key:
            return factor
    raise ConfigError("no factor sets it", key=key, allowed=", ".join(f.key for f in factors))


def _factor(row, path, line):
    def number(column):
        try:
            value = float(row[column])
        except (KeyError, ValueError, TypeError):
            raise ConfigError(
                "is not a number", path=path, line=line, column=column, value=row.get(column)
            ) from None
        if not math.isfinite(value):
            raise ConfigError("is not finite", path=path, line=line, column=column, value=value)
        return value

    for column in ("code", "name", "key"):
        if not row.get(column):
            raise ConfigError("is empty", path=path, line=line, column=column)
    low, high = number("low"), number("high")
    if low >= high:
        raise ConfigError(
            "must be above low",
            path=path,
            line=line,
            column="high",
            value=high,
            allowed=f"more than {low:g}",
        )
    return Factor(row["code"], row["name"], row["key"], low, high, row.get("description") or "")
