"""What `dem new` assumes where nobody told it, and the limits from which on it asks or refuses:
`assumed.csv` has each number with its reason."""

from importlib.resources import files
from types import SimpleNamespace

from dem.tables import table_of

TABLE = table_of(files("calibration.study.new").joinpath("assumed.csv").read_text("utf-8"))


def _number(text):
    if " to " in text:
        return tuple(map(_number, text.split(" to ")))
    return int(text) if text.isdigit() else float(text)


ASSUMED = SimpleNamespace(**{row["name"]: _number(row["value"]) for _, row in TABLE.rows})
